"""One run of a campaign, and its place in the grid."""

from dataclasses import dataclass

from wearlab.campaign.expect import Expectation
from wearlab.scene import Scene

BASE = "base"


@dataclass(frozen=True)
class Case:
    """One run of a campaign.

    Parameters
    ----------
    label : "base", or the label of a ``[[case]]``
    scene : what is run
    position : axis → index; an axis that is missing here is one the run is broadcast along
    expect : what it is expected to come to, None when the file does not say
    """

    label: str
    scene: Scene
    position: dict[str, int]
    expect: Expectation | None = None

    @property
    def id(self) -> str:
        """The identity of the run."""
        return self.scene.id

    def __repr__(self) -> str:
        return f"<Case {self.label!r} {self.position or ''}: {self.scene!r}>"
