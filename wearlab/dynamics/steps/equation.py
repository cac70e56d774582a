"""The equation of motion itself, for methods that do not follow changes of contact."""

from typing import Any

from wearlab.compiled import jit_inner
from wearlab.dynamics.steps.damping_law import see_flanks
from wearlab.dynamics.steps.mesh_law import channel_law, within


@jit_inner
def free_acceleration(kernel: Any, state: Any, out: Any) -> None:
    """Write ``M⁻¹ (F − C q̇ − K q)`` with the loads of unknown size into ``out`` (n,) for ``state`` (2n,)."""
    n, given, balance = len(out), kernel.series, kernel.balance
    for row in range(n):
        out[row] = given.push[row]
        for col in range(n):
            out[row] -= given.stiffness[row, col] * state[col] + given.damping[row, col] * state[n + col]
        for b in range(len(balance.held)):
            out[row] += balance.size[b] * balance.push[b, row]


@jit_inner
def place_and_speed(direction: Any, m: int, state: Any) -> tuple[float, float]:
    """Return ``d_m·q`` and ``d_m·q̇`` of a state (2n,)."""
    n, place, speed = direction.shape[1], 0.0, 0.0
    for row in range(n):
        place += direction[m, row] * state[row]
        speed += direction[m, row] * state[n + row]
    return place, speed


@jit_inner
def see_within(kernel: Any, tables: Any, step: int, x: float, period: float, state: Any, s: Any) -> None:
    """Set what touches and pushes at fraction ``x`` of a step, and the law of the channels there."""
    meshes, law, rub = kernel.meshes, s.law[0], s.rub[0]
    for m in range(len(meshes.damping)):
        place, speed = place_and_speed(kernel.series.direction, m, state)
        see_flanks(
            meshes.law, meshes, tables, step, x, 1.0 / period, m, place, speed, s, law[0, m], rub[0, m]
        )
    channel_law(meshes, s, law, rub, s.mesh, s.force, 1)


@jit_inner
def acceleration(
    kernel: Any, tables: Any, step: int, x: float, period: float, state: Any, s: Any, out: Any
) -> None:
    """Write q̈ (n,) at fraction ``x`` of ``step`` for ``state`` (2n,)."""
    n, given, channels = len(out), kernel.series, len(kernel.meshes.channels)
    count = len(kernel.meshes.damping)
    free_acceleration(kernel, state, out)
    if kernel.fluctuates:
        factor = within(tables.fluctuation[step], x)
        for row in range(n):
            out[row] += factor * given.fluctuation[row]
    see_within(kernel, tables, step, x, period, state, s)
    for c in range(channels):
        place, speed = place_and_speed(given.direction, c % count, state)
        force = s.mesh[c] * place + s.mesh[3 * channels + c] * speed - s.force[c]
        for row in range(n):
            out[row] -= given.per_force[c, row] * force
