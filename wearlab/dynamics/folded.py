"""The orbit of touching meshes where planets do the same at once, see `wearlab.dynamics.folding`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wearlab.arrays import Array, Complex
from wearlab.dynamics.balance import Balance, true_derivative
from wearlab.dynamics.between import TablesWithin
from wearlab.dynamics.folding import WaveBlock, blocks_of
from wearlab.dynamics.known import known_of
from wearlab.dynamics.neighbour import corrected
from wearlab.dynamics.path import Path
from wearlab.dynamics.response import Response
from wearlab.dynamics.ringing import orbit_of_ringing
from wearlab.dynamics.ringing_plan import rings
from wearlab.dynamics.sections import in_sections
from wearlab.dynamics.system import System
from wearlab.dynamics.touching import Parted, of_neighbour, orbit_on_plan, touching_orbit
from wearlab.mesh.stages import StageTables


@dataclass(frozen=True, eq=False)
class Unfolded(Response):
    """The response of a set put together from those of its blocks.

    Parameters
    ----------
    blocks, of_blocks : what the set falls into, and the response of each, the first of which moves
    """

    blocks: tuple[WaveBlock, ...] = ()
    of_blocks: tuple[Response, ...] = ()

    def first_speaks_for(self, meshes: int) -> bool:
        """Whether all meshes of a kind do what the first does: they do, at the same instant."""
        return True

    @cached_property
    def approach(self) -> Path:
        """The projections d·q of the meshes within the steps: those of one planet, for all."""
        first = self.of_blocks[0].approach
        return first._replace(coefficient=np.repeat(first.coefficient, self.blocks[0].planets, axis=-1))

    @cached_property
    def motion(self) -> Path:
        """The coordinates within the steps: those of one planet and the members, for all."""
        block, first = self.blocks[0], self.of_blocks[0]
        coefficient = first.motion.coefficient @ block.lift
        coefficient[0] += (self.state - block.lifted(first.state))[0, 0, : len(self.system.load)]
        return first.motion._replace(coefficient=coefficient)

    @cached_property
    def map_derivative(self) -> Array:
        """(2n, 2n) of the map over a mesh period, from those of the blocks."""
        first, maps = self.blocks[0], [np.asarray(response.derivative) for response in self.of_blocks]
        by_start = maps[0]
        balances = _balances(first, self.system, self.tables, self.mesh_period)
        if balances is not None:
            maps[0] = true_derivative(first.system, balances[0], by_start)
        parts = zip(self.blocks, maps, strict=True)
        derivative = np.sum([block.derivative(own_map) for block, own_map in parts], axis=0)
        if balances is not None:
            own, whole = balances
            by_load = first.lifted(by_start[:, own.held].T).T
            derivative[:, whole.held] = by_load / _ratio(first, own, whole)
        return np.asarray(derivative)

    @cached_property
    def multipliers(self) -> Complex:
        """Floquet multipliers over a mesh period, those of all blocks, largest first."""
        each = zip(self.of_blocks, self.blocks, strict=True)
        every = np.concatenate([np.repeat(own.multipliers, len(block.bases)) for own, block in each])
        return every[abs(every).argsort()[::-1]]


def orbit_held_together(
    system: System,
    tables: StageTables,
    period: float,
    margin: float,
    start: Response | None = None,
    resolved: float = np.inf,
    between: TablesWithin | None = None,
) -> Response | Parted | None:
    """Return what `touching_orbit` does, by the blocks of a set whose planets mesh alike and in phase.

    Parameters
    ----------
    start : of a case solved before, from which the orbit is looked for first
    system, tables, period, margin, resolved, between : as for `touching_orbit`
    """
    turning = system.symmetry
    blocks = () if turning is None else blocks_of(system)
    if turning is None or not blocks or not in_sections(1, turning.mesh, tables.filled):
        near = None if start is None else start.near
        return touching_orbit(system, tables, period, margin, near, resolved, between)
    rung = _rung(blocks, tables, period, margin, resolved)
    if rung is not None:
        if isinstance(rung, Parted):
            return _parted(rung, blocks[0], system, tables, period)
        return _unfolded(system, tables, blocks, rung, between)
    known = start.of_blocks if isinstance(start, Unfolded) else (None,) * len(blocks)
    first, own = blocks[0].system, _of_first_planet(tables)
    near = None if known[0] is None else known[0].near
    corrections = None if near is None else corrected(near, first, own, period)
    if near is None or corrections is None:
        moved = touching_orbit(first, own, period, margin, None, resolved)
    else:
        moved = of_neighbour(near, corrections, first, own, period, margin)
    if not isinstance(moved, Response):
        return None if moved is None else _parted(moved, blocks[0], system, tables, period)
    responses = [moved]
    for block, before in zip(blocks[1:], known[1:], strict=True):
        after = None
        if before is not None and corrections is not None:
            after = _after(before, np.repeat(corrections.law, block.waves, axis=2))
        after = after or _at_rest(block, own, period, margin)
        if after is None:
            return None
        responses.append(after)
    return _unfolded(system, tables, blocks, tuple(responses), between)


def _rung(
    blocks: tuple[WaveBlock, ...], tables: StageTables, period: float, margin: float, resolved: float
) -> tuple[Response, ...] | Parted | None:
    """Return the responses of blocks that are all small enough for series, None where one has none."""
    responses: list[Response] = []
    for block in blocks:
        known = known_of(block.system, tables, period) if rings(block.system) else None
        if known is None or not (known.loaded or responses):
            return None
        mesh = np.repeat([0, block.planets], block.waves)
        orbit = orbit_of_ringing(known, tables, mesh, margin, resolved, rests=bool(responses))
        if not isinstance(orbit, Response):
            return orbit
        responses.append(orbit)
    return tuple(responses)


def _after(before: Response, law: Array) -> Response | None:
    """Return the response of a block at rest after a change of the mesh law, None where that may tell."""
    multipliers = None if before.near is None else before.near.multipliers_after(law)
    return None if multipliers is None else replace(before, found_multipliers=multipliers)


def _over_meshes(tables: StageTables, change: Callable[[Array], Array]) -> StageTables:
    """Return tables of other meshes."""
    given = {name: table for name, table in tables._asdict().items() if name != "width"}
    return tables._replace(**{name: change(table) for name, table in given.items() if table is not None})


def _of_first_planet(tables: StageTables) -> StageTables:
    """Return the tables of the meshes of one planet."""
    planets = tables.error.shape[2] // 2
    return _over_meshes(tables, lambda table: np.ascontiguousarray(table[:, :, ::planets]))


def _without_force(tables: StageTables, waves: int) -> StageTables:
    """Return the tables of meshes in so many waves, whose flanks touch at rest, from those of one planet."""
    gap, error = np.zeros_like(tables.gap), np.zeros_like(tables.error)
    flat = tables._replace(gap=gap, error=error, error_rate=error)
    return flat if waves == 1 else _over_meshes(flat, lambda table: np.repeat(table, waves, axis=2))


def _at_rest(block: WaveBlock, tables: StageTables, period: float, margin: float) -> Response | None:
    """Return the response of a block that nothing moves: it tells what becomes of disturbances.

    ``tables``: of the meshes of one planet.
    """
    own = _without_force(tables, block.waves)
    orbit = orbit_on_plan(known_of(block.system, own, period), own, margin)
    return orbit if isinstance(orbit, Response) else None


def _parted(apart: Parted, block: WaveBlock, system: System, tables: StageTables, period: float) -> Parted:
    """Return where an orbit starts on which flanks part, from that of the first block."""
    state, sizes = block.lifted(apart.state), apart.sizes
    balances = _balances(block, system, tables, period)
    if balances is not None:
        _turn_home(state[None], balances[1])
        sizes = sizes * _ratio(block, *balances)
    return Parted(state, sizes)


def _unfolded(
    system: System, tables: StageTables, blocks: tuple[WaveBlock, ...], responses: tuple[Response, ...],
    between: TablesWithin | None,
) -> Unfolded:  # fmt: skip
    """Return the response of a set from those of its blocks."""
    first, moved = blocks[0], responses[0]
    path, balances = first.lifted(moved.state), _balances(first, system, tables, moved.mesh_period)
    if balances is not None:
        _turn_home(path[0], balances[1])
        system = system._replace(load=moved.system.load @ first.lift)
    attracting = all(response.verdict.attracting for response in responses)
    return Unfolded(
        1, path, None, moved.verdict._replace(attracting=attracting), moved.counts, moved.residual, system,
        tables, moved.mesh_period, between=between, blocks=blocks, of_blocks=responses,
    )  # fmt: skip


def _balances(
    block: WaveBlock, system: System, tables: StageTables, period: float
) -> tuple[Balance, Balance] | None:
    """Return the loads to find of the first block and of the set, which move alike; None: nothing is free."""
    own, whole = (known_of(moving, tables, period).balance for moving in (block.system, system))
    return None if own is None or whole is None else (own, whole)


def _ratio(block: WaveBlock, own: Balance, whole: Balance) -> float:
    """Return the size of a load of the set over that in the first block."""
    moved, push = own.push[0] @ block.lift, whole.push[0]
    return float(moved @ push / (push @ push))


def _turn_home(path: Array, balance: Balance) -> None:
    """Turn a free set, path (n_states, 2n), to where the coordinate that is held begins at 0."""
    shape, (held,) = balance.shape[0], balance.held
    path[:, : len(shape)] -= path[0, held] / shape[held] * shape
