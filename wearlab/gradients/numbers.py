"""The numbers of a scene that derivatives are taken by."""

from collections.abc import Iterable
from typing import Any, NamedTuple, get_args

from wearlab.options import Part, Unit
from wearlab.scene import Scene, SceneError
from wearlab.units import KINDS

SIZES = {"": 1.0, "length": 1e-3, "depth": 1e-6, "angle": 0.1}
"""Least size of a number, by its kind: of one that is 0 or next to it."""


class GradientError(ValueError):
    """A derivative that does not exist, or a request for one that is not understood.

    The message says why and what to do.
    """


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

    def moved(self, scene: Scene, share: float) -> tuple[Scene, float]:
        """Return the scene with this number moved, and by how much it moved.

        Parameters
        ----------
        scene : that has the number
        share : of its size by which the number moves [1]

        Raises
        ------
        GradientError
            When no such scene is valid.
        """
        step = share * max(abs(self.value), SIZES.get(self.kind, 0.0))
        if step == 0.0:
            raise GradientError(
                f"{self.key}: is 0, and no size of a step is known: give it a small "
                "value"
            )
        value = self.value + step
        try:
            changed = scene.replace(
                self.key, f"{value!r} {self.unit}" if self.kind else value
            )
        except SceneError as error:
            raise GradientError("\n".join(error.problems)) from None
        change = number(changed, self.key).value - self.value
        if not change > 0.0:
            raise GradientError(
                f"{self.key}: {self.value:g} cannot be moved: it is no continuous "
                "number"
            )
        return changed, change


def number(scene: Scene, key: str) -> Number:
    """Return a number of a scene.

    Parameters
    ----------
    scene : that has the number
    key : dotted, such as "operation.torque"

    Raises
    ------
    GradientError
        When there is no number at the key.
    """
    value: Any = scene.sections
    for word in key.split("."):
        part = value
        if not isinstance(part, Part) or word not in type(part).model_fields:
            hint = "(`wearlab schema` lists keys; items of lists have none)"
            raise GradientError(f"{key}: this scene has no such number {hint}")
        field = type(part).model_fields[word]
        value = getattr(part, word)
    if not isinstance(value, float):
        is_count = isinstance(value, int) and not isinstance(value, bool)
        kind = "a count" if is_count else "no number"
        raise GradientError(
            f"{key}: {value!r} is {kind}: derivatives are with respect to numbers"
        )
    return Number(key, value, _kind((*field.metadata, field.annotation)))


def _kind(annotations: Iterable[Any]) -> str:
    """Return the kind of the first unit among annotations, "" of a plain number."""
    for annotation in annotations:
        if isinstance(annotation, Unit):
            kind = annotation.kind
        else:
            kind = _kind(get_args(annotation))
        if kind:
            return kind
    return ""
