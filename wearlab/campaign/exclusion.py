"""``exclude``: conditions on keys and on quantities of the gears, by which cases are left out."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from wearlab.campaign.case import Case
from wearlab.campaign.inheritance import CampaignError
from wearlab.query import Key, QueryError, Vocabulary, holds, keys, read_condition
from wearlab.scene import Scene, problems

KEYS = (
    Key("contact_ratio"),
    Key("mesh_frequency", unit="Hz", display_unit="Hz"),
    Key("speed_ratio"),
)
DERIVED = tuple(key.name for key in KEYS)


class Derivation:
    """Computes derived quantities; what several cases share is computed once."""

    def __init__(self) -> None:
        self._critical: dict[str, float | None] = {}

    def __call__(self, name: str, scene: Scene) -> float | None:
        """Return a quantity of `DERIVED`; None where no such gears can be, or the scene has no such thing.

        ``mesh_frequency`` is in Hz; ``speed_ratio`` is the speed of the input over its first critical speed,
        where the mesh frequency meets the lowest natural frequency that the mesh excites.
        """
        from wearlab.gears.specification import GearError

        try:
            return {"contact_ratio": _contact_ratio, "mesh_frequency": _mesh_frequency}.get(
                name, self._speed_ratio
            )(scene)
        except GearError:
            return None

    def _speed_ratio(self, scene: Scene) -> float | None:
        if scene.dynamics is None or scene.operation.speed is None:
            return None
        same = scene.replace("operation.speed", "1 rpm").canonical()
        if same not in self._critical:
            self._critical[same] = _first_excited(scene)
        first, frequency = self._critical[same], _mesh_frequency(scene)
        return None if first is None or frequency is None else frequency / first


def _contact_ratio(scene: Scene) -> float:
    """Return the contact ratio, the smallest where a set has meshes of several kinds."""
    from wearlab.scene.build import sets

    return min(float(kind.pair.contact_ratio) for kind in sets.build_set(scene).kinds)


def _mesh_frequency(scene: Scene) -> float | None:
    from wearlab.scene.build import sets

    return None if scene.operation.speed is None else float(sets.build_set(scene).mesh_frequency)


def _first_excited(scene: Scene) -> float | None:
    """Return the lowest natural frequency that the mesh excites [Hz]."""
    from wearlab.scene.build import build
    from wearlab.scene.build.modes import build_modes

    modes = build_modes(build(scene)).modes
    excited = modes.frequency[modes.excited()]
    return float(excited.min()) if excited.size else None


@dataclass(frozen=True)
class Excluded:
    """A case that is not run.

    Parameters
    ----------
    label, position : as of a case
    condition : the one that excludes it, as the file writes it
    """

    label: str
    position: dict[str, int]
    condition: str


class _Values:
    """The values of one case, each found when it is asked for."""

    def __init__(self, scene: Scene, values: dict[str, Any], derivation: Derivation) -> None:
        self.scene, self.values, self.derivation = scene, values, derivation

    def get(self, name: str) -> Any:
        """Return a value of the scene, or one derived from it."""
        if name in DERIVED and name not in self.values:
            self.values[name] = self.derivation(name, self.scene)
        return self.values.get(name)


def read_conditions(given: Any) -> tuple[str, ...]:
    """Return the conditions of ``exclude``, one text or a list of them."""
    texts = [given] if isinstance(given, str) else given
    if not isinstance(texts, list) or not all(isinstance(text, str) and text.strip() for text in texts):
        raise CampaignError(
            [f"exclude: {problems.shown(given)} is no condition, such as 'speed_ratio > 1.2'"]
        )
    return tuple(texts)


def without_excluded(
    cases: Sequence[Case], conditions: Sequence[str]
) -> tuple[tuple[Case, ...], tuple[Excluded, ...]]:
    """Return the cases that no condition excludes, and the others.

    Raises
    ------
    CampaignError
        When a condition cannot be read, or none of the cases is left.
    """
    if not conditions:
        return tuple(cases), ()
    values = [dict(keys.flat(json.loads(case.scene.canonical()))) for case in cases]
    bound = _bound(conditions, values)
    derivation = Derivation()
    kept, excluded = [], []
    for case, known in zip(cases, values, strict=True):
        asked: Any = _Values(case.scene, known, derivation)
        met = next((text for text, tree in zip(conditions, bound, strict=True) if holds(tree, asked)), None)
        if met is None:
            kept.append(case)
        else:
            excluded.append(Excluded(case.label, case.position, met))
    if not kept:
        raise CampaignError([f"exclude: every one of {len(cases)} cases is excluded"])
    return tuple(kept), tuple(excluded)


def _bound(conditions: Sequence[str], values: Sequence[dict[str, Any]]) -> list[Any]:
    texts = {name: isinstance(value, str) for known in values for name, value in known.items()}
    vocabulary = Vocabulary([*KEYS, *(keys.scene_key(name, text) for name, text in texts.items())])
    bound = []
    for number, text in enumerate(conditions):
        try:
            bound.append(read_condition(text, vocabulary))
        except QueryError as error:
            where = f"at character {error.position + 1} of {error.text!r}"
            raise CampaignError([f"exclude[{number}]: {error.reason} ({where})"]) from None
    return bound
