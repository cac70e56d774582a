"""Translations and rotation of sun, ring, carrier and every planet, in the carrier's frame (W23)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wearlab.dynamics.holding import PlanetarySupports
from wearlab.dynamics.models import DynamicModel, InMotion
from wearlab.options import Switch, option

if TYPE_CHECKING:
    from wearlab.dynamics.system import System


class PlanetaryDynamics(DynamicModel):
    """Translations and rotation of sun, ring, carrier and every planet, in the carrier's frame."""

    kinds: ClassVar[tuple[str, ...]] = ("planetary",)

    model: Literal["planetary"] = option(..., "planetary set, 3(N+3) DOF", source="W23 Eqs. 1–14")
    supports: PlanetarySupports = option(PlanetarySupports(), "what holds the members")
    rotation: Switch = option(
        True, "gyroscopic and centripetal terms of the carrier's frame", source="W23 Eqs. 7–14"
    )

    def build(self, motion: InMotion) -> "System":
        """Return W23's model."""
        import numpy as np

        from wearlab.dynamics import of_planetary as of
        from wearlab.dynamics import planetary
        from wearlab.dynamics.balance import balance_of
        from wearlab.gears.errors import GearError

        radius, inertia, mass = of.radii(motion), of.inertias(motion), of.masses(motion)
        held = self.supports.given
        tangential = of.tangential_stiffness(held, radius)
        tied = of.grounded(tangential)
        speeds = of.train_of(motion).speeds(motion.operation.speed)
        turn = of.mirror(motion) * np.sign(speeds.sun_relative)
        try:
            system = planetary.assemble(
                mass=mass,
                inertia=inertia,
                base_radius=of.base_radii(motion),
                pin_circle_radius=radius["carrier"],
                pressure_angle=of.pressure_angles(motion),
                planet_angles=of.planet_angles(motion),
                radial_stiffness={name: one.radial_stiffness or 0.0 for name, one in held.items()},
                tangential_stiffness=tangential,
                carrier_speed=float(turn * speeds.carrier) if self.rotation else 0.0,
                torque=of.torques(motion, tied),
                radial_damping={
                    name: of.support_damping(one.damping, one.damping_ratio, one.radial_stiffness, mass[name])
                    for name, one in held.items()
                },
                tangential_damping=of.tangential_damping(held, tangential, inertia, radius),
                mesh_damping=of.mesh_damping(
                    motion, planetary.effective_masses(inertia, of.base_radii(motion))
                ),
                damping_always=motion.meshes[0].damps_always,
                backlash=of.backlash(motion),
                friction=self.friction is not None,
                balanced=of.balanced(motion, tied),
            )
        except ValueError as error:
            raise GearError(f"scene.dynamics.supports: {error}") from error
        try:
            balance_of(system, 1.0)
        except ValueError as error:
            raise GearError(
                f"scene.dynamics.supports: {error}, by a torsional_stiffness of its own"
            ) from error
        return system

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Without a load torque, a torsional spring must hold the output."""
        if scene.operation.load_torque != "zero":
            return
        output = scene.operation.output
        support = self.supports.get(output)
        if support is None or not support.holds:
            yield (
                "operation.load_torque",
                f"'zero' leaves the output {output!r} without any load: give dynamics.supports.{output} a "
                "torsional_stiffness, or load_torque = 'balance'",
            )
