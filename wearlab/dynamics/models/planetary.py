"""Models of a planetary set.

All its motions in the carrier's frame (W23), or its rotations alone (B23).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wearlab.dynamics.models import DynamicModel, InMotion
from wearlab.dynamics.supports import PlanetarySupports, PlanetaryTorsionalSupports
from wearlab.options import Switch

if TYPE_CHECKING:
    from wearlab.dynamics.system import System


@contextmanager
def _of_supports(remedy: str = "") -> Iterator[None]:
    """Let a set that cannot move so be refused for what holds it."""
    from wearlab.gears.specification import GearError

    try:
        yield
    except ValueError as error:
        raise GearError(f"scene.dynamics.supports: {error}{remedy}") from error


class PlanetaryDynamics(DynamicModel):
    """Translations and rotation of all members, in the carrier's frame."""

    kinds: ClassVar[tuple[str, ...]] = ("planetary",)

    model: Literal["planetary"]
    """planetary set, 3(N+3) DOF. Source: W23 Eqs. 1–14"""
    supports: PlanetarySupports = PlanetarySupports()
    """what holds the members"""
    rotation: Switch = True
    """gyroscopic and centripetal terms of the carrier's frame. Source: W23 Eqs. 7–14"""

    def build(self, motion: InMotion) -> "System":
        """Return W23's model."""
        from wearlab.dynamics import planetary as of
        from wearlab.dynamics.rigid import balance_of

        rigid = of.rigid_set(motion)
        held = of.held(self.supports, rigid)
        speed = (
            motion.gears.coordinate_speeds["carrier.u"] / rigid.bodies["carrier"].radius
        )
        torques = of.torques(motion, held)._replace(
            carrier_speed=float(speed) if self.rotation else 0.0
        )
        with _of_supports():
            system = of.assemble(
                rigid,
                held,
                of.meshing(motion, rigid),
                torques,
                self.friction is not None,
            )
        with _of_supports(", by a torsional_stiffness of its own"):
            balance_of(system, 1.0)
        return system

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Without a load torque, a torsional spring must hold the output."""
        output = scene.operation.output
        support = self.supports.get(output)
        if scene.operation.output_loaded is False and (
            support is None or not support.holds
        ):
            remedy = (
                f"give dynamics.supports.{output} a torsional_stiffness, or "
                "load_torque = 'balance'"
            )
            yield (
                "operation.load_torque",
                f"'zero' leaves the output {output!r} without any load: {remedy}",
            )


class PlanetaryTorsionalDynamics(DynamicModel):
    """Rotations of sun, planets and carrier; the ring at rest or turning."""

    kinds: ClassVar[tuple[str, ...]] = ("planetary",)

    model: Literal["planetary-torsional"]
    """planetary set, rotations alone. Source: B23 Eqs. 14–20"""
    supports: PlanetaryTorsionalSupports = PlanetaryTorsionalSupports()
    """torsional supports, none by default"""

    def build(self, motion: InMotion) -> "System":
        """Return B23's model of a set whose ring is at rest."""
        import numpy as np

        from wearlab.dynamics import planetary as of

        rigid = of.rigid_set(motion)
        held = of.held(self.supports, rigid)
        meshing = of.meshing(motion, rigid.ring_at_rest)
        with _of_supports():
            rubs = self.friction is not None
            system = of.planetary_torsional(
                rigid, held, meshing, motion.gears.torque, rubs
            )
        if motion.operation.input == "sun" or system.balance is None:
            return system
        carrier = (
            of.torques(motion, {}).given["carrier"] / rigid.bodies["carrier"].radius
        )
        names = np.array(system.coordinates)
        balance = (names == "sun.u").astype(float)
        return system._replace(
            load=np.where(names == "carrier.u", carrier, 0.0), balance=balance
        )

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """The ring is at rest, and the load torque balances."""
        if scene.operation.fixed != "ring":
            said = (
                "the torsional model holds the ring at rest, not "
                f"{scene.operation.fixed!r}"
            )
            yield (
                "operation.fixed",
                f"{said}; give fixed = 'ring' or dynamics.model = 'planetary'",
            )
        if scene.operation.output_loaded is False:
            needed = (
                "the torsional model turns freely and needs the load torque: 'balance'"
            )
            yield "operation.load_torque", needed
