"""A pair behind a flexible shaft: one coordinate more, the rotation of the motor.

``J_m θ̈_m + c (θ̇_m − θ̇_1) + k (θ_m − θ_1) = T``, the pinion takes what the shaft passes on. Written with
``u = r_b1 θ`` for motor and pinion and ``u = r_b2 θ`` for the gear, so that the mesh gives way by u_1 − u_2.
"""

from typing import Annotated, Literal

import numpy as np

from wearlab.dynamics.models import DynamicModel
from wearlab.options import NOT_NEGATIVE, POSITIVE, Inertia, Number, TorsionalSpringRate


class Driveline(DynamicModel):
    """Motor, shaft, pinion and gear, rotations alone."""

    model: Literal["driveline"] = "driveline"
    """pair driven through a flexible shaft. Source: a user"""
    motor_inertia: Annotated[Inertia, POSITIVE]
    """inertia of the motor J_m"""
    shaft_stiffness: Annotated[TorsionalSpringRate, POSITIVE]
    """torsional stiffness k"""
    shaft_damping_ratio: Annotated[Number, NOT_NEGATIVE] = 0.01
    """ratio ζ, c = 2 ζ √(k J_m)"""

    def build(self, motion):
        """Return the system of motor, pinion and gear."""
        from wearlab.dynamics.supports import (
            Support,
            damping_by_ratio,
            damping_of,
            effective_mass,
            stiffness_of,
        )
        from wearlab.dynamics.system import System

        driving, driven = motion.gears.kinds[0].pair.gears
        mesh, radius = motion.meshes[0], driving.base_radius
        mass = effective_mass(driving.inertia / radius**2, driven.inertia / driven.base_radius**2)
        damping = mesh.damping
        if damping is None:
            damping = damping_by_ratio(mesh.damping_ratio, motion.stiffness[0], mass)
        twist = np.array([1.0, -1.0, 0.0])
        rate = 2.0 * self.shaft_damping_ratio * np.sqrt(self.shaft_stiffness * self.motor_inertia)
        shaft = Support("motor", "u", twist, twist, self.shaft_stiffness / radius**2, rate / radius**2)
        force = motion.operation.torque / radius
        return System(
            coordinates=("motor.u", "pinion.u", "gear.u"),
            mass=np.diag(
                [
                    self.motor_inertia / radius**2,
                    driving.inertia / radius**2,
                    driven.inertia / driven.base_radius**2,
                ]
            ),
            damping=damping_of([shaft], 3),
            stiffness=stiffness_of([shaft], 3),
            direction=np.array([[0.0, 1.0, -1.0]]),
            load=np.array([force, 0.0, -force]),
            mesh_damping=np.array([damping]),
            damping_always=mesh.damping_in == "always",
            backlash=None if mesh.normal_backlash is None else np.array([mesh.normal_backlash]),
            supports=(shaft,),
        )
