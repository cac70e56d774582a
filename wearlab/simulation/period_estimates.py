"""Estimated errors of what a mesh period comes to: stiffness and transmission error.

Mean, RMS, extremes and harmonics of a wear state differ from those on half the nodes,
and these from those of the wear that half the nodes make of its rate. Both count: what
rougher nodes lose of carried wear, their rate may give back, which says nothing of the
error. Nothing here vibrates: states whose motion has no rougher twin have a rougher
contact all the same.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.life import history
from wearlab.life.coupled import WearState
from wearlab.mesh.harmonics import harmonics
from wearlab.simulation import companion_runs
from wearlab.simulation.dataset.mesh_period import (
    PeriodContact,
    PeriodSamples,
    contact_over_period,
)
from wearlab.simulation.wear_off import WornFurther

SHARE = 2.0
"""Weight of what half the nodes change [1]."""
BETWEEN = 0.2
"""Weight of what half the nodes lose of the wear of both flanks in the transmission
error, whose extremes may lie between nodes [1]."""


class PeriodErrors(NamedTuple):
    """Estimated errors of one state, or (n_updates,) of several.

    Parameters
    ----------
    stiffness : of mean, RMS and harmonics of the mesh stiffness, the largest of all
        [N/m]
    transmission_error : of mean, RMS, harmonics, largest value and peak to peak of the
        static transmission error, the largest of all [m]
    face_load_factor : of K_Hβ; None where flanks have no width [1]
    """

    stiffness: Any
    transmission_error: Any
    face_load_factor: Any = None

    @classmethod
    def unknown(cls, updates: int) -> Self:
        """Return errors that nothing is known of.

        Parameters
        ----------
        updates : number of states
        """
        return cls(np.full(updates, np.nan), np.full(updates, np.nan))


class PeriodNumbers(NamedTuple):
    """What a mesh period comes to, in numbers whose differences are errors.

    Parameters
    ----------
    stiffness : (n,) mean, RMS and complex harmonics [N/m]
    transmission_error : (m,) mean, RMS, complex harmonics, largest value, peak to peak
        [m]
    """

    stiffness: Array
    transmission_error: Array

    @property
    def largest(self) -> Array:
        """The largest number of both quantities, (2,) [N/m], [m]."""
        return np.array([numbers.max() for numbers in self])

    def differ(self, other: "PeriodNumbers") -> "PeriodNumbers":
        """Return by how much each number differs."""
        of_both = zip(self, other, strict=True)
        return PeriodNumbers(*(np.abs(one - another) for one, another in of_both))

    def plus(self, other: "PeriodNumbers") -> "PeriodNumbers":
        """Return the sums of errors of each number."""
        return PeriodNumbers(*map(np.add, self, other))


def period_numbers(contact: PeriodContact, count: int) -> PeriodNumbers:
    """Return what a mesh period comes to.

    Parameters
    ----------
    contact : over the period
    count : number of harmonics
    """
    extremes = [contact.largest_error, contact.peak_to_peak]
    of_error = np.append(_series_numbers(contact.error, count), extremes)
    return PeriodNumbers(_series_numbers(contact.stiffness, count), of_error)


def _series_numbers(samples: PeriodSamples, count: int) -> Array:
    """Return mean, RMS and complex harmonics of samples, (count + 2,)."""
    series = harmonics(*samples, count)
    turned = series.amplitude * np.exp(1j * series.phase)
    return np.concatenate([[series.mean, series.rms], turned])


def period_errors(
    parts: assembly.GearModel,
    state: WearState,
    rough: assembly.GearModel,
    weight: float = 1.0,
    worse: WearState | None = None,
) -> PeriodErrors:
    """Return the errors of one state, the largest over the kinds of mesh.

    Parameters
    ----------
    parts, state : the physics and the state
    rough : the physics on rougher nodes
    weight : what a change by these nodes is worth [1]
    worse : the state on rougher nodes, worn by as much further as it may be off; None:
        not known
    """
    rougher = _of_kinds(rough, state, carried_from=parts)
    worn = rougher if worse is None else _of_kinds(rough, worse)

    lost_of_flanks = companion_runs.between_nodes(parts, state.wear, rough)
    lost_of_kinds = lost_of_flanks.reshape(-1, 2).sum(axis=1)

    errors = []
    for fine, coarse, further, lost in zip(
        _of_kinds(parts, state), rougher, worn, lost_of_kinds, strict=True
    ):
        by_nodes = fine.differ(coarse)
        by_wear = further.differ(coarse)
        of_stiffness, of_error = SHARE * by_nodes.plus(by_wear).largest
        errors.append((of_stiffness, of_error + BETWEEN * lost))

    stiffness, transmission_error = weight * np.max(errors, axis=0)
    return PeriodErrors(stiffness, transmission_error)


def _of_kinds(
    model: assembly.GearModel,
    state: WearState,
    carried_from: assembly.GearModel | None = None,
) -> list[PeriodNumbers]:
    """Return what a period comes to for every kind of mesh.

    Parameters
    ----------
    model : the physics
    state : the wear state
    carried_from : the physics on whose nodes the wear is, if not on those of the model
    """
    flanks = [kind.flanks for kind in state.kind]
    if carried_from is not None:
        wear = companion_runs.carried_wear(carried_from, state.wear, model)
        as_warm = model.coupling_held_as(state)
        depths = tuple(np.maximum(0.0, depth) for depth in wear)
        forces = companion_runs.carried_forces(carried_from, state, model)
        flanks = as_warm.flanks(depths, felt=as_warm.felt(depths, forces))
    return [
        period_numbers(contact_over_period(worn.analysis, worn.nodes), model.harmonics)
        for worn in flanks
    ]


def errors_along_life(
    parts: assembly.GearModel,
    life_history: history.History,
    worn: Sequence[WornFurther | None],
    block: int = 0,
) -> PeriodErrors:
    """Return the errors of all kept states in one condition, straight between samples.

    Parameters
    ----------
    parts : the physics in that condition
    life_history : the life in that condition
    worn : error of the wear at the samples; None where a state has no twin
    block : number of the condition
    """
    twins = [None if further is None else further.twin for further in worn]
    known = [twin.conditions[block] for twin in twins if twin is not None]
    rough = known[0].parts if known else companion_runs.rough_parts(parts)
    weight = known[0].weight if known else 1.0
    if rough is None:
        return PeriodErrors.unknown(len(life_history.cycle))

    samples = life_history.samples
    rows = []
    for state, further in zip(samples.state, worn, strict=True):
        worse = None if further is None else further.worse[block]
        rows.append(period_errors(parts, state, rough, weight, worse))
    return between_samples(life_history.cycle, samples.cycle, rows)


def between_samples(
    cycle: Array, at_cycles: Array, errors: Sequence[PeriodErrors]
) -> PeriodErrors:
    """Return the errors of states from those of some of them, straight between.

    Parameters
    ----------
    cycle : (n_updates,) cycles of the states [1]
    at_cycles, errors : (k,) cycles of some states, ascending, and their errors
    """
    known = [[error for error in of_state if error is not None] for of_state in errors]
    rows = np.transpose(known)
    return PeriodErrors(*(np.interp(cycle, at_cycles, row) for row in rows))
