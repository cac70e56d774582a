"""What a kind of figure is: a name, what it shows and needs, and a function from a run to its curves."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

from wearlab.figures.ask import Ask
from wearlab.figures.plot import Series

Role = Literal["hue", "rows", "cols"]


@dataclass(frozen=True)
class Kind:
    """A kind of figure, one line of the table.

    Parameters
    ----------
    name : how campaign files call it
    title : its default title
    shows : one sentence
    needs : variables that a run must have
    dims : dimensions that its curves are taken along, ``a|b`` for either
    series : run, or case of an update → curves
    roles : which dimension becomes hue, columns, rows, by preference; ``*`` is a dimension of the grid
    also : variables it draws where a run has them
    all_cases : whether it shows every case when ``select`` names none
    one_flank : whether it shows the first flank when ``select`` names none
    shape : of a panel
    ranks : whether its ordinate is a rank, the first on top
    y : the variable it draws when ``y`` names none
    titled : its title for another variable, with {} for its words; none: the same
    along_x : whether y runs along the abscissa, as in a histogram
    over_sweeps : whether x may be a sweep
    of : what it is drawn from: runs, or the kept update of the campaign
    joined : the series of all runs → the curves to be seen, None: as they are
    """

    name: str
    title: str
    shows: str
    needs: tuple[str, ...]
    dims: tuple[str, ...]
    series: Callable[[Any, Ask], Iterable[Series]]
    roles: tuple[tuple[Role, str], ...]
    also: tuple[str, ...] = ()
    all_cases: bool = False
    one_flank: bool = False
    shape: Literal["wide", "square"] = "wide"
    ranks: bool = False
    y: str = ""
    titled: str = ""
    along_x: bool = False
    joined: Callable[[list[Series]], list[Series]] | None = None
    of: Literal["runs", "update"] = "runs"
    over_sweeps: bool = False

    def curves(self, run: Any, ask: Ask) -> Iterable[Series]:
        """Return the curves of a run, or of a case of an update; without ``y``, of its own variable."""
        return self.series(run, ask if ask.y or not self.y else replace(ask, y=(self.y,)))
