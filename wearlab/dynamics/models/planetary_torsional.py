"""Rotations of sun, planets and carrier; the ring at rest (B23)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wearlab.dynamics.holding import PlanetaryTorsionalSupports
from wearlab.dynamics.models import DynamicModel, InMotion
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.dynamics.system import System


class PlanetaryTorsionalDynamics(DynamicModel):
    """Rotations of sun, planets and carrier; the ring at rest or turning."""

    kinds: ClassVar[tuple[str, ...]] = ("planetary",)

    model: Literal["planetary-torsional"] = option(
        ..., "planetary set, rotations alone", source="B23 Eqs. 14–20"
    )
    supports: PlanetaryTorsionalSupports = option(
        PlanetaryTorsionalSupports(), "torsional supports, none by default"
    )

    def build(self, motion: InMotion) -> "System":
        """Return B23's model of a set whose ring is at rest."""
        import numpy as np

        from wearlab.dynamics import of_planetary as of
        from wearlab.dynamics.planetary import effective_masses
        from wearlab.dynamics.planetary_torsional import planetary_torsional
        from wearlab.gears.errors import GearError

        radius, inertia, mass = of.radii(motion), of.inertias(motion), of.masses(motion)
        held = {name: one for name, one in self.supports.given.items() if name != "ring"}
        tangential = of.tangential_stiffness(held, radius)
        meshing = effective_masses({**inertia, "ring": np.inf}, of.base_radii(motion))
        try:
            system = planetary_torsional(
                inertia={name: inertia[name] for name in ("sun", "planet", "carrier")},
                planet_mass=mass["planet"],
                base_radius=of.base_radii(motion),
                pin_circle_radius=radius["carrier"],
                pressure_angle=of.pressure_angles(motion),
                planet_angles=of.planet_angles(motion),
                sun_torque=of.sun_torque(motion),
                tangential_stiffness=tangential,
                tangential_damping=of.tangential_damping(held, tangential, inertia, radius),
                mesh_damping=of.mesh_damping(motion, meshing),
                damping_always=motion.meshes[0].damps_always,
                backlash=of.backlash(motion),
                friction=self.friction is not None,
            )
        except ValueError as error:
            raise GearError(f"scene.dynamics.supports: {error}") from error
        if motion.operation.input == "sun" or system.balance is None:
            return system
        carrier = of.torques(motion, set())["carrier"] / radius["carrier"]
        names = np.array(system.coordinates)
        return system._replace(
            load=np.where(names == "carrier.u", carrier, 0.0), balance=(names == "sun.u").astype(float)
        )

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """The ring is at rest, and the load torque balances."""
        if scene.operation.fixed != "ring":
            yield (
                "operation.fixed",
                f"the torsional model holds the ring at rest, not {scene.operation.fixed!r}; give "
                "fixed = 'ring' or dynamics.model = 'planetary'",
            )
        if scene.operation.load_torque == "zero":
            yield (
                "operation.load_torque",
                "the torsional model turns freely and needs the load torque: 'balance'",
            )
