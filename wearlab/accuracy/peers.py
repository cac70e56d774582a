"""Integrators that a user would pick instead: SciPy always, CyRK and SUNDIALS when they are installed.

Each gets the compiled equation of motion, tolerances scaled to the orbit, and for free the number of mesh
periods after which its transient is as small as its error.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from wearlab.accuracy.cells import Motion
from wearlab.accuracy.motion import motion_at, motion_of, motion_packed

Array = NDArray[np.float64]
March = Callable[[Motion, Array, float, float, Array, Array | None], Array]
"""(motion, start (2n,), end time [s], relative tolerance, scale (2n,), times or None) -> states (…, 2n)."""


@dataclass(frozen=True)
class Peer:
    """One foreign integrator.

    Parameters
    ----------
    name : library and method
    march : integrates from time 0; returns the states at the times asked for, else the last one
    tolerances : relative tolerances of its ladder, coarse to fine
    """

    name: str
    march: March
    tolerances: tuple[float, ...]


def peers() -> Iterator[Peer]:
    """Yield what is installed."""
    decades = tuple(10.0 ** -np.arange(3.0, 9.5, 1.0))
    fine = tuple(10.0 ** -np.arange(2.0, 11.5, 1.0))
    for method in ("RK45", "DOP853"):
        yield Peer(f"SciPy {method}", _scipy(method), decades)
    if find_spec("CyRK") is not None:
        for method in ("RK45", "TSIT5", "VERN7", "DOP853"):
            yield Peer(f"CyRK {method}", _cyrk(method), fine)
    if find_spec("sksundae") is not None:
        yield Peer("CVODE Adams", _cvode, fine[:-1])  # at 1e-11 it gives up at jumps


def missing_peers() -> tuple[str, ...]:
    """Return the peers that are not installed (``pip install wearlab[peers]``)."""
    return tuple(
        name
        for name, module in (("CyRK", "CyRK"), ("scikit-sundae", "sksundae"))
        if find_spec(module) is None
    )


def _scipy(method: str) -> March:
    def march(
        given: Motion, start: Array, end: float, tolerance: float, scale: Array, times: Array | None
    ) -> Array:
        solution = solve_ivp(
            motion_of, (0.0, end), start, method=method, args=(given.flat,), t_eval=times,
            rtol=tolerance, atol=tolerance * scale,
        )  # fmt: skip
        if not solution.success:
            return np.full((1 if times is None else len(times), len(start)), np.nan)
        return np.asarray(solution.y.T if times is not None else solution.y[:, -1:].T)

    return march


def _cvode(
    given: Motion, start: Array, end: float, tolerance: float, scale: Array, times: Array | None
) -> Array:
    from sksundae.cvode import CVODE

    solver = CVODE(
        motion_packed, userdata=(given.flat,), method="Adams", rtol=tolerance, atol=tolerance * scale,
        max_num_steps=100_000_000,
    )  # fmt: skip
    wanted = np.array([0.0, end]) if times is None else np.concatenate([[0.0], times])
    solution = solver.solve(wanted, start)
    if not solution.success:
        return np.full((1 if times is None else len(times), len(start)), np.nan)
    states = np.asarray(solution.y)
    return states[-1:] if times is None else states[1:]


@cache
def _address() -> int:
    """Return the address of the equation of motion as a C callback for CyRK."""
    import numba
    from numba import carray, types

    double = types.CPointer(types.float64)

    @numba.cfunc(types.void(double, types.float64, double, double))
    def callback(out: Any, time: float, state: Any, flat: Any) -> None:
        rows = 2 * int(carray(flat, 1)[0])
        size = 1  # only its beginning is looked at: kernels do not check bounds
        motion_at(time, carray(state, rows), carray(out, rows), carray(flat, size))

    return int(callback.address or 0)


def _cyrk(method: str) -> March:
    def march(
        given: Motion, start: Array, end: float, tolerance: float, scale: Array, times: Array | None
    ) -> Array:
        from CyRK import nbsolve2_ivp

        solution = nbsolve2_ivp(
            _address(), (0.0, end), np.ascontiguousarray(start), method, times, False, given.flat,
            tolerance, tolerance, np.array([tolerance]), tolerance * scale,
        )  # fmt: skip
        try:
            if not solution.success:
                return np.full((1 if times is None else len(times), len(start)), np.nan)
            return np.array(solution.y.T if times is not None else solution.y[:, -1:].T)
        finally:
            solution.free()

    return march
