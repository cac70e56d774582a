"""Planetary sets: published geometry, mesh phases against teeth
placed by hand, trains, and refusals.
"""

import math
from itertools import permutations

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from shaped import shaped

from wearlab.gears.planetary import Carrier, Train, entry_lag, fraction, planetary_set
from wearlab.gears.specification import GearError, GearSpec

PRINTED = {
    "centre_distance": (0.055125, 0.05625),
    "carrier": Carrier(4.5, 0.011178, 0.0565),
}


def make(sun=None, planet=None, ring=None, carrier=None, **keywords):
    """Build W23's set from changes."""
    return shaped(
        planetary_set,
        GearSpec(
            **{
                "name": "sun",
                "teeth": 20,
                "profile_shift_coefficient": 0.35,
                **(sun or {}),
            }
        ),
        GearSpec(
            **{"name": "planet", "teeth": 29, "face_width": 0.028, **(planet or {})}
        ),
        GearSpec(
            **{"name": "ring", "teeth": 79, "rim_diameter": 0.215, **(ring or {})}
        ),
        carrier or Carrier(4.5, 0.011178),
        **{
            "module": 0.00225,
            "face_width": 0.025,
            "planets": 3,
            "centre_distance": 0.0565,
            **keywords,
        },
    )


def bai(**keywords):
    """Build B23's set, standard gears that fit without shifts."""
    return shaped(
        planetary_set,
        GearSpec(name="sun", teeth=21),
        GearSpec(name="planet", teeth=30),
        GearSpec(name="ring", teeth=81, rim_diameter=0.28),
        Carrier(1.0, 1e-3),
        **{"module": 0.003, "face_width": 0.02, "planets": 3, **keywords},
    )


def test_wang_zhang_2023_common_distance():
    gears = make()
    angles = [
        math.degrees(p.working_pressure_angle)
        for p in (gears.sun_planet, gears.planet_ring)
    ]
    assert angles == pytest.approx([23.534, 20.685], abs=5e-4)
    x_s = gears.sun.profile_shift
    x_p = gears.planet.profile_shift
    x_r = gears.ring.profile_shift
    assert x_s + x_p == pytest.approx(0.664, abs=5e-4)
    assert x_r - x_p == pytest.approx(0.113, abs=5e-4)
    assert gears.carrier.pin_circle_radius == 0.0565
    assert [
        gear.base_radius for gear in (gears.sun, gears.planet, gears.ring)
    ] == pytest.approx([0.02114, 0.03066, 0.08351], abs=2e-5)
    assert gears.passes == pytest.approx(
        {"sun": 3, "planet-sun": 20 / 29, "planet-ring": 20 / 29, "ring": 60 / 79}
    )
    assert gears.sun_planet.driven is gears.planet_ring.driving is gears.planet


def pitch_lag(gears):
    """Return γ_rs from contact at the pitch point to contact at the pitch point, as
    Parker & Lin print it.
    """
    travelled = gears.planet_ring.path.A - gears.sun_planet.path.A
    entry = entry_lag(gears.sun_planet, gears.planet_ring, sun_drives=True)
    return float(fraction(entry - travelled / gears.sun_planet.base_pitch))


def test_wang_zhang_2023_as_printed():
    gears = make({"profile_shift_coefficient": None}, **PRINTED)
    for pair, distance in ((gears.sun_planet, 0.055125), (gears.planet_ring, 0.05625)):
        assert math.degrees(pair.working_pressure_angle) == pytest.approx(
            20.0, abs=1e-9
        )
        assert pair.centre_distance == distance
    assert [g.profile_shift for g in (gears.sun, gears.planet, gears.ring)] == [
        0.0,
        0.0,
        0.0,
    ]
    assert pitch_lag(gears) == pytest.approx(0.0, abs=1e-9)


def test_pitch_to_pitch_lag_of_wang_zhang_2023():
    gears = make()
    assert pitch_lag(gears) == pytest.approx(0.980, abs=5e-4)


class ByHand:
    """Teeth placed on paper: every contact found by turning one flank until it touches
    another.

    Angles are counter-clockwise. Seen from the carrier the sun turns counter-clockwise,
    planets and ring clockwise. Driving sun: the flanks that touch are on the
    counter-clockwise side of the sun's, the planet's (at the sun) and the ring's teeth,
    and on the clockwise side of the planet's at the ring.
    """

    def __init__(self, gears):
        self.gears = gears
        self.side = 1 if gears.sun_drives else -1

    def touch(
        self,
        driver,
        driver_turn,
        driver_side,
        driver_at,
        mate,
        mate_side,
        mate_at,
        towards,
    ):
        """Turn of the mate's tooth nearest to the contact, and the
        contact's radius on the mate.
        """

        def point(r):
            angle = driver_turn + driver_side * driver.half_angle(r)
            return (
                driver_at + r * np.array([math.cos(angle), math.sin(angle)]) - mate_at
            )

        def turn(r):
            x, y = point(r)
            angle = math.atan2(y, x) - towards
            return (
                (angle + math.pi) % (2 * math.pi)
                - math.pi
                + towards
                - mate_side * mate.half_angle(math.hypot(x, y))
            )

        # the driver pushes the mate as far as its farthest point does
        sense = 1 if self.pushed_clockwise(driver) else -1
        middle = driver.base_radius / math.cos(math.radians(21))
        low = max(middle - 1.4 * driver.module, 1.0002 * driver.base_radius)
        found = minimize_scalar(
            lambda r: sense * turn(r),
            bounds=(low, middle + 1.4 * driver.module),
            method="bounded",
            options={"xatol": 1e-12},
        )
        return turn(found.x), math.hypot(*point(found.x))

    def pushed_clockwise(self, driver):
        return self.gears.sun_drives or driver is self.gears.ring

    def planet_of(self, theta, n):
        """Turn of the planet's tooth at the sun, for a sun with a tooth at theta."""
        g = self.gears
        psi = g.planet_angles[n]
        pin = g.sun_planet.centre_distance * np.array([math.cos(psi), math.sin(psi)])
        pitch = 2 * math.pi / g.sun.teeth
        k = round((psi - self.side * pitch / 4 - theta) / pitch)
        nearest = theta + k * pitch
        return self._at_sun(nearest, pin, psi)

    def _at_sun(self, sun_turn, pin, psi):
        """Both flanks are involutes of rigid gears: where they touch
        fixes the planet, whoever drives.
        """
        g = self.gears
        return self.touch(
            g.sun,
            sun_turn,
            self.side,
            np.zeros(2),
            g.planet,
            self.side,
            pin,
            psi + math.pi,
        )


def entry_by_hand(gears, n, mesh):
    """Sun's turn at which a pair of planet n's mesh touches at the
    driven tip, from numeric contacts.
    """
    hand = ByHand(gears)
    side = hand.side
    psi = gears.planet_angles[n]
    a = gears.sun_planet.centre_distance
    b = gears.planet_ring.centre_distance
    unit = np.array([math.cos(psi), math.sin(psi)])
    sun = gears.sun
    planet = gears.planet
    ring = gears.ring
    start = psi - side * sun.half_angle(
        sun.base_radius / math.cos(gears.sun_planet.working_pressure_angle)
    )

    def planet_turn(theta):
        return hand.touch(
            sun, theta, side, np.zeros(2), planet, side, a * unit, psi + math.pi
        )

    if mesh == "sun-planet":
        # radius on the driven gear; of the sun by distance from its own centre
        def beyond(theta):
            _, radius = planet_turn(theta)
            if gears.sun_drives:
                return radius - planet.tip_radius
            return driven_sun_radius(hand, theta, unit, psi) - sun.tip_radius

        reach = 1.2 * 2 * math.pi / sun.teeth
        return (
            brentq(beyond, start - reach, start + 0.1 * reach, xtol=1e-13),
            planet_turn,
            None,
        )

    pitch = 2 * math.pi / planet.teeth
    towards = psi
    near = towards + side * planet.half_angle(
        planet.base_radius / math.cos(gears.planet_ring.working_pressure_angle)
    )
    base_turn = planet_turn(start)[0]
    k = round((near - base_turn) / pitch)

    def ring_contact(theta):
        turn = base_turn - (theta - start) * sun.teeth / planet.teeth + k * pitch
        return hand.touch(
            planet, turn, -side, b * unit, ring, side, np.zeros(2), psi
        ), turn

    def beyond_ring(theta):
        (_, radius), turn = ring_contact(theta)
        if gears.sun_drives:
            return ring.tip_radius - radius
        return driven_planet_radius(hand, turn, b * unit, psi) - planet.tip_radius

    reach = 1.2 * 2 * math.pi / sun.teeth
    return (
        brentq(beyond_ring, start - 1.5 * reach, start + reach, xtol=1e-13),
        planet_turn,
        ring_contact,
    )


def driven_sun_radius(hand, theta, unit, psi):
    """Radius of the contact on a driven sun: search again, over the sun's own flank."""
    return _own_radius(
        hand,
        hand.gears.sun,
        theta,
        hand.side,
        np.zeros(2),
        hand.gears.planet,
        hand.side,
        hand.gears.sun_planet.centre_distance * unit,
        psi + math.pi,
    )


def driven_planet_radius(hand, turn, at, psi):
    return _own_radius(
        hand,
        hand.gears.planet,
        turn,
        -hand.side,
        at,
        hand.gears.ring,
        hand.side,
        np.zeros(2),
        psi,
    )


def _own_radius(hand, own, turn, side, at, mate, mate_side, mate_at, towards):
    _, radius = hand.touch(own, turn, side, at, mate, mate_side, mate_at, towards)
    # the contact lies on both flanks: its distance from the mate fixes that from the
    # own centre
    radii = np.linspace(
        1.0005 * own.base_radius, own.tip_radius + 1.5 * own.module, 4001
    )
    pressure = np.arccos(own.base_radius / radii)
    angle = turn + side * (own.base_half_angle - np.tan(pressure) + pressure)
    x, y = (
        at[:, None]
        + radii * np.array([np.cos(angle), np.sin(angle)])
        - mate_at[:, None]
    )
    gaps = np.hypot(x, y) - radius
    order = np.argsort(gaps)
    return float(np.interp(0.0, gaps[order], radii[order]))


SETS = {
    "W23": make,
    "B23": bai,
    "uneven": lambda **kw: make(
        planet_angles=[0.0, 2 * math.pi * 30 / 99, 2 * math.pi * 64 / 99], **kw
    ),
}


@pytest.mark.parametrize("sun_drives", [True, False], ids=["sun drives", "ring drives"])
@pytest.mark.parametrize("name", SETS)
def test_mesh_phases_against_teeth_placed_by_hand(name, sun_drives):
    gears = SETS[name](sun_drives=sun_drives)
    period = 2 * math.pi / gears.sun.teeth
    first, _, _ = entry_by_hand(gears, 0, "sun-planet")
    entries = [
        entry_by_hand(gears, n, mesh)[0]
        for mesh in ("sun-planet", "planet-ring")
        for n in range(3)
    ]
    lags = (np.array(entries) - first) / period
    distance = (lags - gears.mesh_phase_offset + 0.5) % 1.0 - 0.5
    assert np.max(np.abs(distance)) < 2e-4
    assert gears.mesh_phase_offset[0] == 0.0
    assert np.all((gears.mesh_phase_offset >= 0.0) & (gears.mesh_phase_offset < 1.0))


def test_one_ring_fits_every_planet():
    """The ring's teeth that three planets find by hand are the same
    ring's: the assembly condition.
    """
    gears = SETS["uneven"]()
    turns = []
    for n in range(3):
        theta0, _, ring_contact = entry_by_hand(gears, n, "planet-ring")
        (turn, _), _ = ring_contact(theta0)
        turns.append(turn + theta0 * 20 / 79)
    pitch = 2 * math.pi / 79
    apart = (np.array(turns) - turns[0] + pitch / 2) % pitch - pitch / 2
    assert np.max(np.abs(apart)) < 1e-6


@pytest.mark.parametrize("roles", list(permutations(("sun", "ring", "carrier"))))
def test_train_by_rolling_without_slip(roles):
    """Every choice of input, output and fixed member, against the
    velocities of the pitch points.
    """
    train = Train(20, 29, 79, *roles)
    v = train.speeds(100.0)
    assert getattr(v, roles[0]) == 100.0 and getattr(v, roles[2]) == 0.0
    assert getattr(v, roles[1]) == pytest.approx(100.0 * train.ratio)
    # pitch points with radii in the ratio of the teeth; sizes of the pitch circles from
    # each mesh apart
    assert v.sun_relative * 20 == pytest.approx(-v.planet_relative * 29)
    assert v.ring_relative * 79 == pytest.approx(v.planet_relative * 29)
    assert v.planet == pytest.approx(v.carrier + v.planet_relative)
    T = train.torques(7.0)
    assert getattr(T, roles[0]) == 7.0
    assert sum(T) == pytest.approx(0.0, abs=1e-12)
    power = T.sun * v.sun + T.ring * v.ring + T.carrier * v.carrier
    assert power == pytest.approx(0.0, abs=1e-9)
    assert getattr(T, roles[0]) * 100.0 > 0.0  # the input brings power
    assert train.sun_drives is (T.sun * (v.sun - v.carrier) > 0.0)
    assert train.torques(T.carrier, "carrier") == pytest.approx(T)
    assert train.mesh_frequency(100.0) == pytest.approx(
        20 * abs(v.sun_relative) / (2 * math.pi)
    )


def test_trains_one_knows():
    assert Train(20, 29, 79).ratio == pytest.approx(20 / 99)
    assert Train(20, 29, 79, "sun", "ring", "carrier").ratio == pytest.approx(-20 / 79)
    assert Train(20, 29, 79).sun_drives
    wind = Train(20, 29, 79, "carrier", "sun", "ring")
    assert wind.ratio == pytest.approx(99 / 20) and not wind.sun_drives
    assert wind.mesh_frequency(2 * math.pi) / 20 == pytest.approx(79 / 20)
    with pytest.raises(GearError, match="each once"):
        Train(20, 29, 79, "sun", "sun", "ring")


def test_ring_driven_set_has_its_pairs_the_other_way_round():
    gears = make(sun_drives=False)
    assert (
        gears.sun_planet.driving.name == "planet"
        and gears.sun_planet.driven.name == "sun"
    )
    assert (
        gears.planet_ring.driving.name == "ring"
        and gears.planet_ring.driven.name == "planet"
    )
    assert (gears.sun.name, gears.planet.name, gears.ring.name) == (
        "sun",
        "planet",
        "ring",
    )
    assert gears.planet_ring.contact_ratio == pytest.approx(
        make().planet_ring.contact_ratio
    )


def test_shifts_are_solved_from_whichever_is_given():
    known = [gear.profile_shift for gear in (make().sun, make().planet, make().ring)]
    for place in range(3):
        given = [
            {"profile_shift_coefficient": x if i == place else None}
            for i, x in enumerate(known)
        ]
        gears = make(*given)
        found = [g.profile_shift for g in (gears.sun, gears.planet, gears.ring)]
        assert found == pytest.approx(known, rel=1e-9)
    halves = make({"profile_shift_coefficient": None})
    assert halves.sun.profile_shift == pytest.approx(halves.planet.profile_shift)
    assert any("split in halves" in flag for flag in halves.sun.assumed)


def test_printed_angles_are_rounded_to_whole_teeth():
    gears = make(
        planet_angles=[0.1, 0.1 + math.radians(109.09), 0.1 + math.radians(232.73)]
    )
    exact = 0.1 + 2 * math.pi / 99 * np.array([0, 30, 64])
    assert gears.planet_angles == pytest.approx(exact, abs=1e-15)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"planets": 4},
            r"equally .* = 99 teeth put planet 2 24\.75 .* are 0, 90\.9091, 181\.818, "
            r"269",
        ),
        ({"planets": 1}, "at least 2 planets, not 1"),
        (
            {"planet_angles": [0.0, 2.0, 4.0]},
            r"planets at these angles cannot be assembled: .* 31\.51 teeth",
        ),
        ({"planet_angles": [0.0, 2.0]}, "2 planet angles for 3 planets"),
        ({"planet_angles": [0.0, 4.0, 2.0]}, "must rise"),
        ({"centre_distance": None}, r"differ: .* and leave the ring's shift to it"),
        (
            {"ring": {"profile_shift_coefficient": 0.7}},
            r"difference of the profile shifts is 0\.3858, but",
        ),
        ({"centre_distance": 0.0500}, "no involute contact"),
        ({"ring": {"teeth": 28}}, "28 teeth cannot surround a planet of 29"),
        ({"carrier": Carrier(0.0, 1.0)}, "carrier: mass must be positive"),
        (
            {"carrier": Carrier(1.0, 1.0, 0.113)},
            "pin_circle_diameter 226 mm is far from",
        ),
        (
            {"carrier": Carrier(1.0, 1.0, 0.057)},
            "pin_circle_diameter 114 mm is far from",
        ),
        (
            {
                **PRINTED,
                "carrier": Carrier(1.0, 1.0),
                "sun": {"profile_shift_coefficient": 0.0},
            },
            "no pin",
        ),
    ],
)
def test_refusals(changes, message):
    with pytest.raises(GearError, match=message):
        make(**changes)


def test_neighbouring_planets_collide():
    with pytest.raises(
        GearError, match=r"planets 1 and 2 collide: their pins are .* tip diameter is"
    ):
        bai(planets=6)
    assert bai(planets=3).planets == 3
    with pytest.raises(GearError, match="planets 3 and 1 collide"):
        bai(planet_angles=[0.0, 2 * math.pi * 34 / 102, 2 * math.pi * 80 / 102])
