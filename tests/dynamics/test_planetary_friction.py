"""Tooth friction of planetary sets against forces at points: surface speeds, cross
products, scipy.

Nothing here knows of the model's vectors. Bodies lie in the carrier's frame, pairs
touch at points of their lines of action, friction acts against the sliding of one
surface on the other, and moments are ``r × F``.
"""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from planetary_arguments import rigid_set, rotating, translating
from scipy.integrate import solve_ivp

from wearlab.dynamics.forces.energy import energy_balance
from wearlab.dynamics.rigid import MESHES, RigidSet, balanced_torques
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Counts, Response, Verdict, accelerations
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageGrid, StageTables, stage_grid

Array = Any
ALPHA = {"sun_planet": np.deg2rad(20.0), "planet_ring": np.deg2rad(22.0)}
SUN, PLANET = 31.5e-3, 45e-3
PIN = SUN + PLANET
RADIUS = {
    "sun": SUN * np.cos(ALPHA["sun_planet"]),
    "planet": PLANET * np.cos(ALPHA["sun_planet"]),
    "ring": PLANET * np.cos(ALPHA["sun_planet"]) + PIN * np.cos(ALPHA["planet_ring"]),
}
MASS = {"sun": 1.1, "ring": 6.0, "carrier": 7.0, "planet": 2.4}
INERTIA = {"sun": 7e-4, "ring": 9e-2, "carrier": 2e-2, "planet": 2.6e-3}
RADIAL = {"sun": 2e8, "ring": 4e8, "carrier": 3e8, "planet": 1e8}
RADIAL_DAMPING = {"sun": 3e3, "ring": 5e3, "carrier": 4e3, "planet": 2e3}
RING = 2e9, 4e3
MESH_DAMPING = {"sun_planet": 900.0, "planet_ring": 1400.0}
TORQUE = 150.0
PITCH = 8.856e-3
PERIOD = 1.0 / 900.0
CARRIER_SPEED = (
    PITCH / PERIOD / RADIUS["sun"] * 21 / 81
)  # of a ring at rest, when the sun turns by 102/81 of it
ENTRY = {"sun_planet": -6.2e-3, "planet_ring": -5.1e-3}
RATIO = {"sun_planet": 1.62, "planet_ring": 1.83}
SOFT = {"sun_planet": 2.4e8, "planet_ring": 3.1e8}
LAG = {"sun_planet": 0.0, "planet_ring": 0.37}


def rotated(vector: Array, angle: float) -> Array:
    c = np.cos(angle)
    s = np.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def cross(one: Array, two: Array) -> float:
    return float(one[0] * two[1] - one[1] * two[0])


def turning(speed: float, arm: Array) -> Array:
    return speed * np.array([-arm[1], arm[0]])


def pair_values(
    mesh: str, phase: Array, middle: Array, j: int
) -> tuple[Array, Array, Array]:
    """Stiffness, gap and path position of pair j at its mesh's own phase.

    ``middle`` decides at jumps.
    """
    x = phase + j
    inside = middle + j < RATIO[mesh]
    stiffness = np.where(
        inside, SOFT[mesh] * (1.0 - 0.3 * (2.0 * x / RATIO[mesh] - 1.0) ** 2), 0.0
    )
    return stiffness, 3e-6 * np.sin(3.0 * x) ** 2, ENTRY[mesh] + x * PITCH


class Scene(NamedTuple):
    """A set at work: number of planets, friction, and whether the planets' centres move
    on their own.
    """

    planets: int
    friction: float
    translations: bool = True
    carrier_speed: float = CARRIER_SPEED

    @property
    def angles(self) -> Array:
        return 0.3 + 2.0 * np.pi * np.arange(self.planets) / self.planets

    @property
    def meshes(self) -> list[tuple[str, int]]:
        return [(mesh, planet) for mesh in MESHES for planet in range(self.planets)]

    def lag(self, mesh: str, planet: int) -> float:
        return float((LAG[mesh] + planet / self.planets) % 1.0)

    @property
    def breaks(self) -> Array:
        own = [
            np.array([0.0, RATIO[m] - 1.0, -ENTRY[m] / PITCH]) + self.lag(m, p)
            for m, p in self.meshes
        ]
        return np.unique(np.round(np.mod(np.concatenate(own), 1.0), 12))

    def tables(self, grid: StageGrid) -> StageTables:
        middle = (grid.start + 0.5 * grid.width)[:, None] * np.ones(3)
        columns = np.zeros((4, len(grid.width), 3, len(self.meshes), 2))
        for at, (mesh, planet) in enumerate(self.meshes):
            inner = np.mod(middle - self.lag(mesh, planet), 1.0)
            own = inner + grid.phase - middle
            for j in (0, 1):
                k, gap, s = pair_values(mesh, own, inner, j)
                sign = np.where(
                    k > 0.0, np.sign(ENTRY[mesh] + (inner + j) * PITCH), 0.0
                )
                columns[:, :, :, at, j] = (
                    k,
                    gap,
                    self.friction * sign,
                    self.friction * sign * s,
                )
        error = np.zeros(columns.shape[1:4])
        return StageTables(
            grid.width,
            columns[0],
            columns[1],
            error,
            error,
            None,
            columns[2],
            columns[3],
        )

    @property
    def rigid(self) -> RigidSet:
        return rigid_set(MASS, INERTIA, RADIUS, PIN, ALPHA, self.angles)

    def system(self, **changes: Any) -> System:
        given: dict[str, Any] = {
            "rigid": self.rigid,
            "mesh_damping": MESH_DAMPING,
            "friction": True,
        }
        if not self.translations:
            return rotating(**given, sun_torque=TORQUE, **changes)
        given |= {
            "radial_stiffness": RADIAL,
            "radial_damping": RADIAL_DAMPING,
            "balanced": "carrier",
            "tangential_stiffness": {"ring": RING[0]},
            "tangential_damping": {"ring": RING[1]},
            "carrier_speed": self.carrier_speed,
            "torque": {"sun": TORQUE},
        }
        return translating(**(given | changes))

    @property
    def nominal(self) -> dict[str, float]:
        """Angular speeds seen from outside."""
        relative = relative_speeds()
        carrier = -relative["ring"]
        return {name: speed + carrier for name, speed in relative.items()}

    def whole(self, system: System) -> Array:
        """Return the nominal speed of every coordinate."""
        speeds = self.nominal
        found = []
        for name in system.coordinates:
            member, axis = name.split(".")
            kind = member.split("-")[0]
            if axis == "u":
                found.append(
                    speeds[kind] * (PIN if kind == "carrier" else RADIUS[kind])
                )
            elif kind == "planet":
                angle = self.angles[int(member.split("-")[1]) - 1]
                found.append(
                    speeds["carrier"]
                    * PIN
                    * {"x": -np.sin(angle), "y": np.cos(angle)}[axis]
                )
            else:
                found.append(0.0)
        return np.array(found)


def relative_speeds() -> dict[str, float]:
    """Angular speeds in the carrier's frame: one base pitch passes in a period."""
    path = PITCH / PERIOD
    return {
        "sun": path / RADIUS["sun"],
        "planet": -path / RADIUS["planet"],
        "ring": -path / RADIUS["ring"],
        "carrier": 0.0,
    }


POWERS = (
    "sun",
    "carrier",
    "friction",
    "bearings",
    "mesh_damping",
    "parametric",
    "gaps",
)


def newton(
    scene: Scene,
    load: float,
    middle: float,
    time: float,
    y: Array,
    always: bool = False,
) -> tuple[Array, dict[str, float]]:
    """Return accelerations of all bodies, from forces at points, and the powers.

    Bodies: sun, ring, carrier, planets; y: their centres and angles (x, y, θ), then the
    speeds.
    """
    count = 3 + scene.planets
    at, speed = y.reshape(2, count, 3)
    names = ["sun", "ring", "carrier", *["planet"] * scene.planets]
    out = np.array([np.cos(scene.angles), np.sin(scene.angles)]).T
    home = np.vstack([np.zeros((3, 2)), PIN * out])
    force = np.zeros((count, 2))
    moment = np.zeros(count)
    power = dict.fromkeys(POWERS, 0.0)
    relative = relative_speeds()
    outside = scene.nominal
    spins = speed[:, 2] + np.array([outside[name] for name in names])
    # External torques; the sun drives.
    moment[0] += TORQUE
    moment[2] -= load
    power["sun"] = TORQUE * spins[0]
    power["carrier"] = load * spins[2]
    # Supports.
    for b, name in enumerate(("sun", "ring", "carrier")):
        force[b] += -RADIAL[name] * at[b, :2] - RADIAL_DAMPING[name] * speed[b, :2]
        power["bearings"] += RADIAL_DAMPING[name] * speed[b, :2] @ speed[b, :2]
    moment[1] -= RADIUS["ring"] ** 2 * (RING[0] * at[1, 2] + RING[1] * speed[1, 2])
    power["bearings"] += RING[1] * (RADIUS["ring"] * speed[1, 2]) ** 2
    omega = scene.carrier_speed
    for n in range(scene.planets):
        b = 3 + n
        along = turning(1.0, out[n])
        inner = 1.0 - MASS["planet"] * omega**2 / RADIAL["planet"]
        stretch = at[b, :2] - at[2, :2] - PIN * inner * at[2, 2] * along
        rate = speed[b, :2] - speed[2, :2] - PIN * speed[2, 2] * along
        pull = RADIAL["planet"] * stretch
        drag = RADIAL_DAMPING["planet"] * rate
        force[b] -= pull + drag
        force[2] += pull + drag
        moment[2] += PIN * along @ (inner * pull + drag)
        moment[2] -= MASS["planet"] * omega**2 * inner * PIN**2 * at[2, 2]
        power["bearings"] += drag @ rate
    # Meshes: pairs touch at points, friction acts against sliding.
    phase = time / PERIOD
    for mesh, n in scene.meshes:
        one, two = (
            (0, 3 + n) if mesh == "sun_planet" else (3 + n, 1)
        )  # who drives, who is driven
        along = turning(1.0, out[n])
        if mesh == "sun_planet":
            # on the planet
            push = rotated(along, -ALPHA[mesh])
            pitch = SUN * out[n]
        else:
            push = -rotated(along, ALPHA[mesh])
            pitch = (PIN + RADIUS["planet"] / np.cos(ALPHA[mesh])) * out[n]
        inner = (middle - scene.lag(mesh, n)) % 1.0
        own = inner + phase - middle
        touching = always
        for j in (0, 1):
            k, gap, s = (float(value) for value in pair_values(mesh, own, inner, j))
            if k == 0.0:
                continue
            point = pitch + s * push
            arm1 = point - home[one]
            arm2 = point - home[two]
            shift = (
                at[one, :2]
                + turning(at[one, 2], arm1)
                - at[two, :2]
                - turning(at[two, 2], arm2)
            )
            rate = speed[one, :2] + turning(speed[one, 2], arm1)
            rate = rate - speed[two, :2] - turning(speed[two, 2], arm2)
            slide = [
                turning(relative[names[one]], p - home[one])
                - turning(relative[names[two]], p - home[two])
                for p in (point, pitch + (ENTRY[mesh] + (inner + j) * PITCH) * push)
            ]
            assert abs(slide[0] @ push) < 1e-9 * PITCH / PERIOD
            across = slide[1] / np.linalg.norm(
                slide[1]
            )  # sliding turns at the pitch point, between segments
            normal = k * max(0.0, shift @ push - gap)
            touching = touching or normal > 0.0
            on_two = normal * push + scene.friction * normal * across
            force[one] -= on_two
            force[two] += on_two
            moment[one] -= cross(arm1, on_two)
            moment[two] += cross(arm2, on_two)
            power["friction"] += scene.friction * normal * across @ (slide[0] + rate)
            tiny = 1e-6
            k2, gap2, _ = pair_values(mesh, own + tiny, inner, j)
            k1, gap1, _ = pair_values(mesh, own - tiny, inner, j)
            depth = max(0.0, shift @ push - gap)
            power["parametric"] -= 0.5 * float(k2 - k1) / (2 * tiny * PERIOD) * depth**2
            power["gaps"] += normal * float(gap2 - gap1) / (2 * tiny * PERIOD)
        # Damping needs no point of its own: it acts along the line of action, while
        # flanks touch.
        damping = MESH_DAMPING[mesh] * (rate @ push) * touching
        force[one] -= damping * push
        force[two] += damping * push
        moment[one] -= cross(point - home[one], damping * push)
        moment[two] += cross(point - home[two], damping * push)
        power["mesh_damping"] += damping * (rate @ push)
    masses = np.array([MASS[name] for name in names])
    inertias = np.array([INERTIA[name] for name in names])
    planar = force / masses[:, None]
    planar += omega**2 * at[:, :2] + 2.0 * omega * np.stack(
        [speed[:, 1], -speed[:, 0]], 1
    )
    return np.column_stack([planar, moment / inertias]), power


def lengths(scene: Scene) -> Array:
    """Radii that make arcs of angles: the model's coordinates over
    those of the bodies, (members, 3).
    """
    names = ["sun", "ring", "carrier", *["planet"] * scene.planets]
    return np.array(
        [[1.0, 1.0, PIN if name == "carrier" else RADIUS[name]] for name in names]
    )


def motion(scene: Scene, system: System, seed: int, steps: int = 40) -> Response:
    """Return any motion with teeth in contact and apart, as if it were a response."""
    n = len(system.load)
    grid = stage_grid(scene.breaks, steps)
    rng = np.random.default_rng(seed)
    state = (
        rng.normal(size=(1, len(grid.width) + 1, 2 * n))
        * np.r_[np.full(n, 2e-5), np.full(n, 0.05)]
    )
    verdict = Verdict(True, None, True, True)
    counts = Counts(0, 0, 0)
    return Response(
        1,
        state,
        np.empty(0, complex),
        verdict,
        counts,
        0.0,
        system,
        scene.tables(grid),
        PERIOD,
    )


@pytest.mark.parametrize("planets", [2, 3])
@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5])
def test_accelerations_are_those_of_forces_at_points(
    planets: int, friction: float
) -> None:
    scene = Scene(planets, friction, carrier_speed=5.0 * CARRIER_SPEED)
    system = scene.system(damping_always=True)
    response = motion(scene, system, planets)
    load = 700.0
    system = system._replace(load=system.load - load / PIN * np.array(system.balance))
    response = replace(response, system=system)
    ours = accelerations(response)
    grid = stage_grid(scene.breaks, 40)
    radius = lengths(scene)
    for step in range(0, len(grid.width), 3):
        for end in (0, 1):
            time = (grid.start[step] + end * grid.width[step]) * PERIOD
            middle = grid.start[step] + 0.5 * grid.width[step]
            y = (response.state[0, step + end].reshape(2, -1, 3) / radius).ravel()
            found, _ = newton(scene, load, middle, time, y, always=True)
            size = np.abs(ours[0, step, end]).max()
            np.testing.assert_allclose(
                (found * radius).ravel(),
                ours[0, step, end],
                atol=1e-10 * size,
                err_msg=f"{step}",
            )


@cache
def orbit(scene: Scene, steps: int = 900) -> Response:
    return Periodic().solve(
        scene.system(), scene.tables(stage_grid(scene.breaks, steps)), PERIOD
    )


@pytest.mark.slow
@pytest.mark.parametrize(("planets", "friction"), [(2, 0.1), (3, 0.1), (3, 0.5)])
def test_orbit_load_and_every_power_agree_with_scipy(
    planets: int, friction: float
) -> None:
    """Newton's law at points, integrated over the period, closes on
    the orbit with the load found.
    """
    scene = Scene(planets, friction)
    response = orbit(scene)
    load = -float(np.array(response.system.balance) @ response.system.load) * PIN
    radius = lengths(scene)
    y = (response.state[0, 0].reshape(2, -1, 3) / radius).ravel()
    y, rows = np.r_[y, np.zeros(len(POWERS))], len(y)
    jumps = 0.0
    edges = np.r_[np.unique(np.r_[0.0, scene.breaks]), 1.0]
    stored = []
    for low, high in pairwise(edges):
        middle = 0.5 * (low + high)

        def law(time: float, state: Array, middle: float = middle) -> Array:
            found, power = newton(scene, load, middle, time, state[:rows])
            return np.r_[state[rows // 2 : rows], found.ravel(), list(power.values())]

        before = mesh_energy(scene, low, middle, y[:rows])
        y = solve_ivp(
            law,
            (low * PERIOD, high * PERIOD),
            y,
            method="DOP853",
            rtol=1e-10,
            atol=1e-15,
        ).y[:, -1]
        stored.append((before, mesh_energy(scene, high, middle, y[:rows])))
    jumps = sum(
        stored[(i + 1) % len(stored)][0] - one[1] for i, one in enumerate(stored)
    )
    end = (y[:rows].reshape(2, -1, 3) * radius).ravel()
    size = np.abs(response.state[0]).max(axis=0)
    size = np.repeat([size[: rows // 2].max(), size[rows // 2 :].max()], rows // 2)
    assert (np.abs(end - response.state[0, -1]) < 1e-5 * size).all()
    powers = dict(zip(POWERS, y[rows:] / PERIOD, strict=True))
    powers["parametric"] -= jumps / PERIOD
    found = energy_balance(response, scene.whole(response.system))
    limit = 1e-6 * found.input
    for theirs, ours in (
        ("sun", found.input),
        ("carrier", found.output),
        ("friction", found.friction),
        ("bearings", found.bearing_damping),
        ("mesh_damping", found.mesh_damping),
        ("parametric", found.parametric),
        ("gaps", found.moving_gaps),
    ):
        assert powers[theirs] == pytest.approx(ours, abs=limit), theirs
    assert abs(found.residual) < 1e-6
    assert found.friction > 0.1 * friction * found.input
    assert (
        min(abs(found.bearing_damping), abs(found.parametric), abs(found.moving_gaps))
        > 10.0 * limit
    )


def mesh_energy(scene: Scene, phase: float, middle: float, y: Array) -> float:
    """Return ``Σ ½ k x²`` [J]."""
    system = scene.system()
    delta = system.direction @ (y.reshape(2, -1, 3)[0] * lengths(scene)).ravel()
    total = 0.0
    for at, (mesh, planet) in enumerate(scene.meshes):
        inner = (middle - scene.lag(mesh, planet)) % 1.0
        for j in (0, 1):
            k, gap, _ = pair_values(mesh, inner + phase - middle, inner, j)
            total += 0.5 * float(k) * max(0.0, float(delta[at] - gap)) ** 2
    return total


@pytest.mark.slow
def test_no_friction_is_the_model_without() -> None:
    scene = Scene(3, 0.0)
    smooth = orbit(scene)
    grid = stage_grid(scene.breaks, 900)
    plain = Periodic().solve(
        scene.system(
            friction=False,
            balanced=None,
            torque=balanced_torques(scene.rigid, TORQUE) | {"ring": 0.0},
        ),
        scene.tables(grid)._replace(sliding=None, moment=None),
        PERIOD,
    )
    size = np.abs(plain.state).max(axis=(0, 1))
    assert (
        np.abs((smooth.state - plain.state) @ np.eye(36)) <= 1e-7 * size.max()
    ).all()


@pytest.mark.slow
def test_stiff_supports_make_the_torsional_model() -> None:
    stiff = {member: 1e3 * value for member, value in RADIAL.items()}
    scene = Scene(3, 0.2)
    turns = Scene(3, 0.2, translations=False)
    grid = stage_grid(scene.breaks, 2400)
    system = scene.system(
        radial_stiffness=stiff, tangential_stiffness={"ring": 1e3 * RING[0]}
    )
    held = Periodic().solve(system, scene.tables(grid), PERIOD)
    torsional = Periodic().solve(turns.system(), turns.tables(grid), PERIOD)
    one, two = (
        energy_balance(response, own.whole(response.system))
        for response, own in ((held, scene), (torsional, turns))
    )
    assert abs(one.residual) < 1e-6 and abs(two.residual) < 1e-6
    assert one.friction == pytest.approx(
        two.friction, rel=2e-3
    )  # 1.4e-2 with supports a tenth as stiff
    assert one.efficiency == pytest.approx(
        two.efficiency, abs=2e-3 * (1.0 - two.efficiency)
    )


@pytest.mark.slow
@pytest.mark.parametrize("fast", [1.0, 30.0])
def test_power_is_made_of_nothing_at_no_speed(fast: float) -> None:
    """The carrier's frame turns: pins off their planets, Coriolis forces.

    What goes in comes out.
    """
    scene = Scene(3, 0.1, carrier_speed=fast * CARRIER_SPEED)
    found = energy_balance(orbit(scene), scene.whole(scene.system()))
    assert abs(found.residual) < 1e-6
    assert 0.95 < found.efficiency < 0.995
