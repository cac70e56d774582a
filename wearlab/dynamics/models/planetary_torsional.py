"""Rotations of sun, planets and carrier; the ring at rest (B23)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wearlab.dynamics.models import DynamicModel, InMotion
from wearlab.dynamics.supports import PlanetaryTorsionalSupports
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

        from wearlab.dynamics import planetary_torsional as of
        from wearlab.dynamics.planetary_torsional import planetary_torsional
        from wearlab.gears.specification import GearError

        rigid = of.rigid_set(motion)
        try:
            system = planetary_torsional(
                rigid,
                of.held(self.supports, rigid),
                of.meshing(motion, rigid.ring_at_rest),
                motion.gears.torque,
                friction=self.friction is not None,
            )
        except ValueError as error:
            raise GearError(f"scene.dynamics.supports: {error}") from error
        if motion.operation.input == "sun" or system.balance is None:
            return system
        carrier = of.torques(motion, set()).given["carrier"] / rigid.bodies["carrier"].radius
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
        if scene.operation.output_loaded is False:
            yield (
                "operation.load_torque",
                "the torsional model turns freely and needs the load torque: 'balance'",
            )
