"""The numbers of a scene that derivatives are taken with respect to."""

from collections.abc import Iterable
from typing import Any, NamedTuple, get_args

from wearlab.options import Part, Unit
from wearlab.scene import Scene, SceneError
from wearlab.units import KINDS

STEP, STEP_OF_LARGE = 1e-7, 1e-6
"""Change of a number over its size: the second order is lost, and round-off is still a millionth of it.

Orbits of many coordinates round off more: wear depths of a planetary set are 7e-4 of the largest derivative
off by 1e-7, and 4e-5 by 1e-6 (5e-6 and 1e-5 do no better).
"""
SIZES = {"": 1.0, "length": 1e-3, "depth": 1e-6, "angle": 0.1}
"""Least size of a number, by its kind: of one that is 0 or next to it."""


class GradientError(ValueError):
    """A derivative that is not there, or not asked for rightly; the message says why and what to do."""


class Number(NamedTuple):
    """A number of a scene.

    Parameters
    ----------
    key : dotted key
    value : in SI
    kind : of its unit, "" for a plain number
    """

    key: str
    value: float
    kind: str

    @property
    def unit(self) -> str:
        """SI unit."""
        return KINDS[self.kind].unit if self.kind else "1"

    def moved(self, scene: Scene, by: float) -> tuple[Scene, float]:
        """Return the scene with this number moved by a share of its size, and by how much it moved.

        Raises
        ------
        GradientError
            When no such scene is valid.
        """
        step = by * max(abs(self.value), SIZES.get(self.kind, 0.0))
        if step == 0.0:
            raise GradientError(f"{self.key}: is 0, and no size of a step is known: give it a small value")
        value = self.value + step
        try:
            changed = scene.replace(self.key, f"{value!r} {self.unit}" if self.kind else value)
        except SceneError as error:
            raise GradientError("\n".join(error.problems)) from None
        moved = number(changed, self.key).value - self.value
        if not moved > 0.0:
            raise GradientError(f"{self.key}: {self.value:g} cannot be moved: it is no continuous number")
        return changed, moved


def number(scene: Scene, key: str) -> Number:
    """Return a number of a scene.

    Raises
    ------
    GradientError
        When there is no number at the key.
    """
    part: Any = scene
    *path, last = key.split(".")
    for word in path:
        part = _within(part, word, key)
    value = _within(part, last, key)
    if isinstance(value, bool) or not isinstance(value, float):
        said = "a count" if isinstance(value, int) and not isinstance(value, bool) else "no number"
        raise GradientError(f"{key}: {value!r} is {said}: derivatives are with respect to numbers")
    field = type(part).model_fields[last]
    return Number(key, value, _kind((*field.metadata, field.annotation)))


def _within(part: Any, word: str, key: str) -> Any:
    if not isinstance(part, Part | Scene) or word not in type(part).model_fields:
        raise GradientError(
            f"{key}: this scene has no such number (`wearlab schema` lists keys; items of lists have none)"
        )
    return getattr(part, word)


def _kind(marked: Iterable[Any]) -> str:
    """Return the kind of the first unit among marks and annotations, "" of a plain number."""
    kinds = (each.kind if isinstance(each, Unit) else _kind(get_args(each)) for each in marked)
    return next(filter(None, kinds), "")
