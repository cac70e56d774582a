"""Estimated errors of a mesh period where flanks have a width, from half the slices."""

from collections.abc import Sequence
from typing import cast

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
    between_samples,
    period_numbers,
)

SHARE = 1.0
"""Weight of what half the slices and nodes change of stiffness and transmission error
[1]."""
LOAD_FACTOR_SHARE = 2.0
"""The same of K_Hβ, which is of first order in the outermost slices [1]."""

WINDOWS = (1.0, 1.5)
"""Windows at which K_Hβ is compared, over its own: slices of half the number may happen
to fit one [1]."""


def face_period_errors(
    model: assembly.GearModel,
    rough: assembly.GearModel,
    loads: Sequence[LineLoads],
    rough_loads: Sequence[LineLoads],
) -> PeriodErrors:
    """Return the errors of one state, the largest over the kinds of mesh.

    Parameters
    ----------
    model, rough : the physics, and that on half the slices and nodes
    loads, rough_loads : line loads of each kind of mesh in the state, by either
    """
    errors = [np.zeros(3)]
    of_kinds = zip(_contacts(model), _contacts(rough), loads, rough_loads, strict=True)
    for contact, rough_contact, lines, rough_lines in of_kinds:
        numbers = period_numbers(contact_over_period(contact, lines), model.harmonics)
        rough_numbers = period_numbers(
            contact_over_period(rough_contact, rough_lines), model.harmonics
        )
        window = normal_module(model, contact)
        of_period = SHARE * numbers.differ(rough_numbers)
        of_factor = LOAD_FACTOR_SHARE * max(
            abs(
                load_factor(contact, lines, share * window)
                - load_factor(rough_contact, rough_lines, share * window)
            )
            for share in WINDOWS
        )
        errors.append(np.append(of_period, of_factor))
    return PeriodErrors(*np.max(errors, axis=0))


def face_periods_along_life(
    models: Sequence[assembly.GearModel],
    rougher: Sequence[assembly.GearModel],
    life_history: history.History,
    rough_loads: Sequence[Sequence[Sequence[LineLoads]]],
) -> tuple[PeriodErrors, ...]:
    """Return the errors of all kept states in every condition, from first and last.

    Parameters
    ----------
    models, rougher : the physics in each condition, and that on half the slices
    life_history : the life
    rough_loads : of each condition, of the first state and of the last if there are
        several: line loads of each kind of mesh by the rougher physics
    """
    ends = [life_history.state[0], life_history.state[-1]]
    errors = []
    for block, of_ends in enumerate(rough_loads):
        at_ends = []
        for state, rough_lines in zip(ends, of_ends, strict=False):
            lines = line_loads(state.conditions[block])
            at_ends.append(
                face_period_errors(models[block], rougher[block], lines, rough_lines)
            )
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
