"""Estimated errors of a mesh period where flanks have a width.

From half the slices and nodes, with the wear of a life on these, and from twice the
nodes. Half the nodes of a helical face may end as near to E as its own, of which the
error is of first order; half those of a spur set may be as many as its own.
"""

from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.life import history
from wearlab.life.coupled import WearState
from wearlab.life.face_coupling import FaceState
from wearlab.mesh.face.contact import FaceContact, LineLoads
from wearlab.simulation.dataset.face import (
    contact_over_period,
    load_factor,
    normal_module,
)
from wearlab.simulation.period_estimates import (
    PeriodErrors,
    PeriodNumbers,
    between_samples,
    period_numbers,
)

SHARE = 1.0
"""Weight of what half the slices and nodes change of stiffness and transmission error
[1]."""
FINER_SHARE = 2.0
"""The same of twice the nodes, at first order [1]."""
LOAD_FACTOR_SHARE = 2.0
"""The same of K_Hβ, which is of first order in the outermost slices [1]."""

WINDOWS = (1.0, 1.5)
"""Windows at which K_Hβ is compared, over its own: slices of half the number may happen
to fit one [1]."""


class LoadedState(NamedTuple):
    """A state under its static load, on slices and nodes of its own or on others.

    Parameters
    ----------
    model : the physics on these
    loads : line loads of each kind of mesh
    """

    model: assembly.GearModel
    loads: Sequence[LineLoads]

    def period_numbers(self) -> list[PeriodNumbers]:
        """Return what a mesh period comes to, of each kind of mesh."""
        return [
            period_numbers(contact_over_period(contact, lines), self.model.harmonics)
            for contact, lines in zip(_contacts(self.model), self.loads, strict=True)
        ]


class Twins(NamedTuple):
    """Twins of one state.

    Parameters
    ----------
    rough : on half the slices and nodes
    lived : the same, worn as these wear; None: as the state
    finer : on twice the nodes, None where these cannot be
    """

    rough: LoadedState
    lived: LoadedState | None
    finer: LoadedState | None


def face_period_errors(state: LoadedState, twins: Twins) -> PeriodErrors:
    """Return the errors of one state, the largest over the kinds of mesh.

    Parameters
    ----------
    state : the state itself
    twins : its twins
    """
    numbers = state.period_numbers()
    rough_numbers = twins.rough.period_numbers()
    by_nodes = _apart(numbers, rough_numbers)
    if twins.lived is not None:
        by_wear = _apart(rough_numbers, twins.lived.period_numbers())
        by_nodes = [
            one.plus(other) for one, other in zip(by_nodes, by_wear, strict=True)
        ]
    of_period = [SHARE * errors.largest for errors in by_nodes]
    if twins.finer is not None:
        by_finer = _apart(numbers, twins.finer.period_numbers())
        of_period += [FINER_SHARE * errors.largest for errors in by_finer]
    stiffness, transmission_error = np.max(of_period, axis=0)
    of_factor = _error_of_load_factor(state, twins.rough)
    return PeriodErrors(stiffness, transmission_error, of_factor)


def _apart(
    numbers: list[PeriodNumbers], others: list[PeriodNumbers]
) -> list[PeriodNumbers]:
    """Return by how much numbers of each kind of mesh differ."""
    of_kinds = zip(numbers, others, strict=True)
    return [one.differ(other) for one, other in of_kinds]


def _error_of_load_factor(state: LoadedState, rough: LoadedState) -> float:
    """Return the error of K_Hβ, the largest over the kinds of mesh [1]."""
    errors = [0.0]
    of_kinds = zip(
        _contacts(state.model),
        _contacts(rough.model),
        state.loads,
        rough.loads,
        strict=True,
    )
    for contact, rough_contact, lines, rough_lines in of_kinds:
        window = normal_module(state.model, contact)
        errors += [
            abs(
                load_factor(contact, lines, share * window)
                - load_factor(rough_contact, rough_lines, share * window)
            )
            for share in WINDOWS
        ]
    return LOAD_FACTOR_SHARE * max(errors)


def face_periods_along_life(
    models: Sequence[assembly.GearModel],
    life_history: history.History,
    twins: Sequence[Sequence[Twins]],
) -> tuple[PeriodErrors, ...]:
    """Return the errors of all kept states in every condition, from first and last.

    Parameters
    ----------
    models : the physics in each condition
    life_history : the life
    twins : of each condition, of the first state and of the last if there are several
    """
    ends = [life_history.state[0], life_history.state[-1]]
    errors = []
    for block, of_ends in enumerate(twins):
        at_ends = []
        for end, twins_there in zip(ends, of_ends, strict=False):
            state = LoadedState(models[block], line_loads(end.conditions[block]))
            at_ends.append(face_period_errors(state, twins_there))
        cycles = life_history.cycle[[0, -1]][: len(at_ends)]
        errors.append(between_samples(life_history.cycle, cycles, at_ends))
    return tuple(errors)


def line_loads(state: WearState) -> list[LineLoads]:
    """Return the line loads of every kind of mesh in a state.

    Parameters
    ----------
    state : of flanks with a width
    """
    return [cast("FaceState", of_kind).loads for of_kind in state.kind]


def felt_wear(state: WearState) -> list[Array]:
    """Return the wear that every kind of mesh feels in a state, (2, n_face, n) [m].

    Parameters
    ----------
    state : of flanks with a width
    """
    return [cast("FaceState", of_kind).felt for of_kind in state.kind]


def static_loads(model: assembly.GearModel, wear: Sequence[Array]) -> list[LineLoads]:
    """Return the line loads of every kind of mesh under its static load.

    Parameters
    ----------
    model : the physics
    wear : (2, n_face, n) of every kind of mesh [m]
    """
    assert model.face is not None
    return [
        kind.contact.solve(kind.felt(depth))
        for kind, depth in zip(model.face.kinds, wear, strict=True)
    ]


def _contacts(model: assembly.GearModel) -> list[FaceContact]:
    """Return the contact of every kind of mesh over its face."""
    assert model.face is not None
    return [kind.contact for kind in model.face.kinds]
