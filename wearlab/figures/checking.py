"""What can be said of a campaign's figures before anything is computed or drawn."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.figures.ask import read
from wearlab.figures.errors import FigureError, choices
from wearlab.figures.kinds import KINDS
from wearlab.schema import DIMENSIONS, VARIABLES

if TYPE_CHECKING:
    from wearlab.campaign import Campaign


def figure_problems(campaign: "Campaign") -> list[str]:
    """Return one line for each ``[[figure]]`` that no run could satisfy: its kind, names or labels are wrong.

    Parameters
    ----------
    campaign : its figures, axes and cases
    """
    folder = campaign.path.parent if campaign.path else None
    problems = []
    for number, spec in enumerate(campaign.figures, 1):
        try:
            problems += list(_problems(campaign, spec, number, folder))
        except FigureError as error:
            problems.append(str(error))
    return problems


def _problems(campaign: "Campaign", spec: Any, number: int, folder: Any) -> Iterator[str]:
    ask = read(spec, number, folder)
    if ask.kind not in KINDS:
        yield f"figure {number}: kind {ask.kind!r} is unknown; {choices(ask.kind, KINDS)}"
    axes = {axis.name: axis for axis in campaign.axes}
    beside = {name for axis in campaign.axes for name in axis.coordinates}
    keys = {word for axis in campaign.axes for word in (axis.key, axis.key.rpartition(".")[2])}
    names = {*axes, *beside, "case", *(dimension.name for dimension in DIMENSIONS), *VARIABLES}
    for key in ask.select:
        if key not in names:
            yield f"{ask.name}: select.{key} is unknown; {choices(key, sorted(names - set(VARIABLES)))}"
    for role in ("x", "hue", "rows", "cols"):
        name = getattr(ask, role)
        if name is not None and name not in names | keys:
            yield f"{ask.name}: {role} = {name!r} is unknown; {choices(name, sorted(names))}"
    for name in ask.y:
        of_update = ask.kind in KINDS and KINDS[ask.kind].of == "update"
        if name not in VARIABLES and not of_update:
            yield f"{ask.name}: y = {name!r} is no variable; {choices(name, VARIABLES)}"
    if isinstance(ask.published, Path) and not ask.published.is_file():
        yield f"{ask.name}: published file {spec.published} is not there"
