"""Worn flanks as curves of the complex plane.

Shares no formula with wearlab.mesh.exact.

Points come in a tooth's own axes (ring: the tooth space's). The line of centres is the
real axis; where a gear's forward sense is clockwise, or it looks back along the line of
centres, ``sense`` is −1.
"""

import numpy as np
from scipy.optimize import brentq, minimize_scalar


class WornCurve:
    def __init__(self, pair, gear, depth):
        body = pair.gears[gear]
        external = not pair.internal
        self.sense = (
            (1.0, -1.0)[gear] if external else (-1.0 if pair.driving.internal else 1.0)
        )
        # an external driven gear's tooth looks back at the driving gear
        self.turned = -1.0 if external and gear == 1 else 1.0
        small = min(pair.gears, key=lambda g: g.base_radius)
        at_far = gear == 1 if external else body is small
        self.centre = pair.centre_distance if at_far else 0.0
        self.half = body.base_half_angle
        self.r_b = body.base_radius
        self.internal = body.internal
        self.depth = depth
        self.at_pitch = body.base_radius * np.tan(pair.working_pressure_angle)
        rho = pair.curvature(np.array([pair.path.A, pair.path.E]))[gear]
        self.low, self.high = (r / self.r_b - self.half for r in sorted(rho))

    def position(self, lam):
        return self.sense * (self.r_b * (lam + self.half) - self.at_pitch)

    def angle(self, s):
        return (self.at_pitch + self.sense * s) / self.r_b - self.half

    def own(self, lam):
        """Point in the tooth's own axes, unwound from the base circle.

        Wear leaves the gear's material.
        """
        normal = 1j * np.exp(-1j * lam)
        off = self.depth(self.position(lam)) * (1.0 if self.internal else -1.0)
        return (
            self.r_b * np.exp(-1j * lam) + (self.r_b * (lam + self.half) + off) * normal
        )

    def placed(self, lam, forwards):
        return self.centre + self.turned * self.own(lam) * np.exp(
            1j * self.sense * forwards
        )


def driven_angle(driving, driven, phi1, lam1):
    """Rotation of the driven gear that brings its flank through one
    point of the driving one.
    """
    point = driving.placed(lam1, phi1) - driven.centre
    radius = abs(point)
    ends = sorted((driven.low, driven.high))
    f = lambda lam: abs(driven.own(lam)) - radius  # noqa: E731
    if f(ends[0]) * f(ends[1]) > 0.0:
        return -np.inf
    lam2 = brentq(f, *ends, xtol=1e-16, rtol=8.9e-16)
    turned = np.angle(driven.turned * point / driven.own(lam2))
    return driven.sense * turned


def first_touch(driving, driven, phi1, guess, width=0.05):
    """Largest rotation of the driven gear over the driving flank,
    near a guess of its angle.
    """
    low = max(driving.low, guess - width)
    high = min(driving.high, guess + width)
    lam = np.linspace(low, high, 400)
    found = np.array([driven_angle(driving, driven, phi1, one) for one in lam])
    best = int(np.argmax(found))
    step = lam[1] - lam[0]
    refined = minimize_scalar(
        lambda one: -driven_angle(driving, driven, phi1, one),
        bounds=(max(low, lam[best] - step), min(high, lam[best] + step)),
        method="bounded",
        options={"xatol": 1e-12},
    )
    return max(found[best], -refined.fun)
