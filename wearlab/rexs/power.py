"""Speeds and torques of all shafts of a gear unit, without losses."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from wearlab.rexs.document import Component, Document
from wearlab.rexs.quantities import number, truth
from wearlab.rexs.wheel import GEARS, Wheel

CASING = "casing"
"""The group of everything that is fixed."""


class Link(NamedTuple):
    """A stage between two groups of shafts.

    Parameters
    ----------
    stage : number of its component
    first, second : the groups
    ratio : speed of the second over speed of the first
    """

    stage: str
    first: str
    second: str
    ratio: float


class Flow(NamedTuple):
    """How power flows in one load case.

    Parameters
    ----------
    speeds : of every group that is reached [rpm]
    torques : number of a stage → torque that the first group puts into it [N m]
    """

    speeds: dict[str, float]
    torques: dict[str, float]


class ShaftGroups:
    """Shafts that turn as one, joined by couplings that are engaged.

    Parameters
    ----------
    document : the file
    """

    def __init__(self, document: Document):
        self.leader: dict[str, str] = {}
        for relation in document.relations:
            if relation.type != "side":
                continue
            joint = document.components.get(relation.members.get("assembly", ""))
            if joint is None or not _is_engaged(joint):
                continue
            inner = self._name(document, relation.members.get("inner_part", ""))
            outer = self._name(document, relation.members.get("outer_part", ""))
            self._join(inner, outer)

    @staticmethod
    def _name(document: Document, component: str) -> str:
        """Return the number of a component, or the name of all that is fixed."""
        found = document.components.get(component)
        fixed = found is not None and found.type == "gear_casing"
        return CASING if fixed else component

    def _join(self, first: str, second: str) -> None:
        """Let two parts turn as one; what is joined to the casing stands still."""
        leaders = {self.of(first), self.of(second)}
        kept = CASING if CASING in leaders else min(leaders)
        for leader in leaders - {kept}:
            self.leader[leader] = kept

    def of(self, component: str) -> str:
        """Return the group of a component.

        Parameters
        ----------
        component : its number
        """
        while component in self.leader:
            component = self.leader[component]
        return component


def _is_engaged(joint: Component) -> bool:
    """Tell whether a part joins what stands at its two sides against rotation."""
    if joint.type == "coupling":
        return True
    return joint.type == "switchable_coupling" and truth(joint, "is_engaged") is True


def flow(document: Document, groups: ShaftGroups, links: Iterable[Link]) -> Flow:
    """Return speeds and torques of one load case.

    Parameters
    ----------
    document : the file in that load case
    groups : shafts that turn as one
    links : the stages between them
    """
    links = tuple(links)
    speeds = _speeds(document, groups, links)
    return Flow(speeds, _torques(document, groups, links, speeds))


def _speeds(
    document: Document, groups: ShaftGroups, links: tuple[Link, ...]
) -> dict[str, float]:
    """Return the speeds of all groups that the given ones reach [rpm]."""
    speeds = {
        groups.of(shaft.id): read.value
        for shaft in document.of_type("shaft")
        if truth(shaft, "defines_speed") is not False
        and (read := number(shaft, "rotational_speed", "rpm")) is not None
    }
    for _ in links:
        for link in links:
            if link.first in speeds:
                speeds.setdefault(link.second, speeds[link.first] * link.ratio)
            elif link.second in speeds and link.ratio != 0.0:
                speeds[link.first] = speeds[link.second] / link.ratio
    return speeds


def _torques(
    document: Document,
    groups: ShaftGroups,
    links: tuple[Link, ...],
    speeds: dict[str, float],
) -> dict[str, float]:
    """Return the torques of the stages where the balance of every shaft gives them.

    Unknown are the torque of every stage and that of every group whose load is not
    given; on each group the sum of torques vanishes.
    """
    loads = _loads(document, groups, speeds)
    names = sorted({group for link in links for group in (link.first, link.second)})
    given = {name: loads.get(name) for name in names}
    free = [
        name
        for name in names
        if given[name] is None and (name in loads or _is_end(name, links))
    ]
    balance = np.zeros((len(names), len(links) + len(free)))
    for column, link in enumerate(links):
        balance[names.index(link.first), column] -= 1.0
        balance[names.index(link.second), column] += 1.0 / link.ratio
    for column, name in enumerate(free, len(links)):
        balance[names.index(name), column] = 1.0

    if all(load is None for load in given.values()):
        return {}
    known = np.array([-(given[name] or 0.0) for name in names])
    return dict(_solved(balance, known, links))


def _solved(
    balance: np.ndarray, known: np.ndarray, links: tuple[Link, ...]
) -> Iterator[tuple[str, float]]:
    """Yield the torques that the balance leaves no choice for."""
    solution, _, _, _ = np.linalg.lstsq(balance, known, rcond=None)
    if not np.allclose(balance @ solution, known, rtol=1e-9, atol=1e-9):
        return

    _, singular, rows = np.linalg.svd(balance)
    rank = int(np.sum(singular > 1e-10 * singular[0])) if len(singular) else 0
    undecided = rows[rank:]
    for column, link in enumerate(links):
        if np.all(np.abs(undecided[:, column]) < 1e-9):
            yield link.stage, float(solution[column])


def _is_end(group: str, links: tuple[Link, ...]) -> bool:
    """Tell whether only one stage reaches a group."""
    return sum(group in (link.first, link.second) for link in links) == 1


def _loads(
    document: Document, groups: ShaftGroups, speeds: dict[str, float]
) -> dict[str, float | None]:
    """Return the outer torque of groups [N m], None where the others decide it."""
    loads: dict[str, float | None] = {}
    for load in document.of_type("external_load"):
        shaft = next(document.partners("assembly", "part", load.id, "assembly"), None)
        if shaft is None or truth(load, "transmits_torque") is False:
            continue

        group = groups.of(shaft.id)
        torque = _torque_of(load, speeds.get(group))
        if torque is None:
            loads.setdefault(group, None)
        else:
            loads[group] = (loads.get(group) or 0.0) + torque
    return loads


def _torque_of(load: Component, speed: float | None) -> float | None:
    """Return the torque of a load [N m], or its power over the speed [rpm]."""
    if truth(load, "defines_torque") is False:
        return None

    torque = number(load, "torque_around_u_axis", "N*m")
    if torque is not None:
        return torque.value

    power = number(load, "power", "W")
    if power is not None and speed:
        return power.value / (speed * np.pi / 30.0)
    return None


def pair_link(
    document: Document,
    groups: ShaftGroups,
    stage: Component,
    wheels: tuple[Wheel, Wheel],
) -> Link | None:
    """Return a pair as a link between two groups, None where a shaft is missing.

    Parameters
    ----------
    document : the file
    groups : shafts that turn as one
    stage : the pair's component
    wheels : its gears
    """
    first, second = wheels
    if first.teeth is None or second.teeth is None:
        return None
    if first.shaft is None or second.shaft is None:
        return None

    outwards = first.is_ring == second.is_ring
    ratio = first.teeth / second.teeth * (-1.0 if outwards else 1.0)
    return Link(stage.id, groups.of(first.shaft.id), groups.of(second.shaft.id), ratio)


def gears_of(
    document: Document, stage: Component
) -> tuple[Component, Component] | None:
    """Return the two gears of a cylindrical stage, None where one is missing.

    Parameters
    ----------
    document : the file
    stage : the pair's component
    """
    relation = next(document.related("stage", "stage", stage.id), None)
    if relation is None:
        return None

    first = document.components.get(relation.members.get("gear_1", ""))
    second = document.components.get(relation.members.get("gear_2", ""))
    if first is None or second is None:
        return None
    if first.type not in GEARS or second.type not in GEARS:
        return None
    return first, second
