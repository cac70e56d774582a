"""How unevenly a flank is worn: its largest depth over the mean one, and a figure of it over the cycles."""

from wearlab.figures.kind import Kind
from wearlab.figures.kinds.cycles import over_cycles
from wearlab.variable import Result, Variable


def wear_unevenness(run):
    """Return the largest over the mean depth along the path, (update, flank) [1]."""
    depth = run["wear_depth"]
    return depth.max("profile") / depth.mean("profile")


RESULT = Result(
    "wear_unevenness",
    Variable(("update", "flank"), "1", "1", "largest over mean wear depth"),
    wear_unevenness,
    needs=("wear_depth",),
)
UNEVENNESS = Kind(
    name="wear-unevenness",
    title="Unevenness of wear",
    shows="largest over mean wear depth over the cycles",
    needs=("wear_unevenness", "cycle"),
    dims=("update",),
    series=lambda run, ask: over_cycles(run, "wear_unevenness", ask),
    roles=(("hue", "flank"), ("cols", "*"), ("rows", "*")),
    y="wear_unevenness",
)
