"""A number read off stored runs by a formula: its grammar, and how it is computed.

No code is run.

Every name becomes an array with its unit.

::

    formula = term { ("+" | "-") term } term    = factor { ("*" | "/") factor } factor
    = "-" factor | item { "[" place { "," place } "]" } item    = number | function "("
    formula [ "," dimension ] ")" | "where" "(" formula "," formula ")" | name | "("
    formula ")" place   = dimension "=" ( number | word | text in quotes )
"""

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from wearlab import nearest, units
from wearlab.query import evaluate, keys

LONGEST = 1000
DEEPEST = 30
NUMBER = re.compile(r"-?\s*(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
WORD = re.compile(r"[^\W\d][\w-]*")
TEXT = re.compile(r"'[^']*'|\"[^\"]*\"")
NOT_PYTHON = re.compile(
    rf"{TEXT.pattern}|(?<==)\s*{WORD.pattern}(?=\s*[,\]])|[=:#\\]|\s|[^\W\x00-\x7f]"
)
"""Texts; words after an equals sign; and what Python would read as something else."""
SIGNS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
}


class Measured(NamedTuple):
    """Values with their unit."""

    values: Any
    units: str


Places = Mapping[str, Any]
WorkedOut = Callable[[Any, Places], Measured]
"""What part of a formula comes to on a campaign's dataset, at places of its
dimensions."""


class Named(NamedTuple):
    """A variable or coordinate of the runs, and where a formula names it."""

    name: str
    at: int


class Formula(NamedTuple):
    """A formula that was read: the names in it, and how it is worked out."""

    names: tuple[Named, ...]
    worked_out: WorkedOut


def parse_formula(text: str) -> Formula:
    """Return what a formula names, and how it is worked out.

    Parameters
    ----------
    text : of the grammar above

    Raises
    ------
    QueryError : it does not follow the grammar; the message points at the place

    Examples
    --------
    >>> parse_formula("max(wear_depth[flank=sun]) / 2").names
    (Named(name='wear_depth', at=4),)
    """
    if len(text) > LONGEST:
        raise keys.QueryError(
            f"{len(text)} characters, more than {LONGEST}", text[:40] + "…", 0
        )
    source = NOT_PYTHON.sub(_in_python, text)
    lead = len(source) - len(source.lstrip())
    try:
        tree = ast.parse(source.lstrip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        at = lead + (getattr(error, "offset", None) or 1) - 1
        reason = f"no formula: {getattr(error, 'msg', 'too deep')}"
        raise keys.QueryError(reason, text, min(at, len(text))) from None
    reader = _FormulaReader(text, lead)
    worked_out = reader.read(tree, 0)  # which finds the names
    return Formula(tuple(reader.names), worked_out)


def _in_python(match: re.Match[str]) -> str:
    """Return what stands for a part of a formula where Python reads it.

    It has the same length.
    """
    part = match[0]
    if part.isspace():
        return " "
    if part in "=:#\\":
        return ":" if part == "=" else "?"
    return f"'{'_' * (len(part) - 2)}'" if part[0] in "'\"" else "_" * len(part)


def spelled_out(text: str, meanings: Mapping[str, str]) -> str:
    """Return a formula in which names that stand for formulas are replaced by these.

    In brackets.

    Parameters
    ----------
    text : the formula
    meanings : formulas by the names that stand for them
    """
    places = [(n.at, n.name) for n in parse_formula(text).names if n.name in meanings]
    for at, name in sorted(places, reverse=True):
        text = f"{text[:at]}({meanings[name]}){text[at + len(name) :]}"
    return text


@dataclass(frozen=True)
class _FormulaReader:
    """Reads a formula from Python's syntax tree, and refuses what its grammar lacks."""

    text: str
    lead: int
    names: list[Named] = field(default_factory=list)

    def part(self, node: ast.expr) -> str:
        """Return what a formula has for a node."""
        return self.text[
            self.lead + node.col_offset : self.lead + (node.end_col_offset or 0)
        ]

    def fail(self, reason: str, node: ast.expr) -> keys.QueryError:
        """Return an error that points at a node."""
        return keys.QueryError(reason, self.text, self.lead + node.col_offset)

    def read(self, node: ast.expr, depth: int) -> WorkedOut:
        """Return what computes a part of the formula.

        Parameters
        ----------
        node : of Python's syntax tree
        depth : of brackets around it

        Raises
        ------
        QueryError : the grammar has no such part
        """
        if depth > DEEPEST:
            raise self.fail(f"nested deeper than {DEEPEST}", node)
        match node:
            case ast.Constant() if NUMBER.fullmatch(self.part(node)):
                return partial(_number, float(self.part(node)))
            case ast.Name():
                self.names.append(Named(self.part(node), self.lead + node.col_offset))
                return partial(_variable, self.part(node))
            case ast.Attribute():
                raise self.fail(f"{self.part(node)!r} is no variable of the runs", node)
            case ast.UnaryOp(ast.USub(), inner):
                negated = self.read(inner, depth + 1)
                return partial(_joined, "-", partial(_number, 0.0), negated)
            case ast.BinOp(left, sign, right) if type(sign) in SIGNS:
                first = self.read(left, depth)
                second = self.read(right, depth + 1)
                return partial(_joined, SIGNS[type(sign)], first, second)
            case ast.Subscript(inner, places):
                listed = places.elts if isinstance(places, ast.Tuple) else [places]
                placed = self.read(inner, depth + 1)
                return partial(_placed, placed, dict(map(self.place, listed)))
            case ast.Call(ast.Name("where"), [inner, condition], []):
                argument = self.read(inner, depth + 1)
                return partial(_kept, argument, self.read(condition, depth + 1))
            case ast.Call(ast.Name("where"), _, _):
                raise self.fail("expected where(formula, formula)", node)
            case ast.Call(ast.Name(name), [inner, *along], []):
                argument = self.read(inner, depth + 1)
                dim = self.dimension(name, along, node)
                return partial(_applied, name, argument, dim)
        raise self.fail("expected a number, a name or '('", node)

    def dimension(
        self, function: str, along: Sequence[ast.expr], node: ast.expr
    ) -> str | None:
        """Return the dimension along which a function is taken, None: along all.

        Parameters
        ----------
        function : its name
        along : what stands after the first argument
        node : the call

        Raises
        ------
        QueryError : there is no such function, or it takes something else
        """
        if function not in keys.FUNCTIONS:
            raise self.fail(
                f"no function {function!r}; there are {', '.join(keys.FUNCTIONS)}", node
            )
        is_name = len(along) < 2 and all(isinstance(dim, ast.Name) for dim in along)
        lacks_dim = function.endswith("_at") and not along
        if not is_name or lacks_dim:
            raise self.fail(f"expected {function}(formula, dimension)", node)
        return self.part(along[0]) if along else None

    def place(self, node: ast.expr) -> tuple[str, float | str]:
        match node:
            case ast.Slice(ast.Name() as dim, ast.expr(), None):
                label = self.part(node).partition("=")[2].strip()
                if NUMBER.fullmatch(label):
                    return self.part(dim), float(label.replace(" ", ""))
                if WORD.fullmatch(label) or TEXT.fullmatch(label):
                    return self.part(dim), label if WORD.fullmatch(label) else label[
                        1:-1
                    ]
        raise self.fail(
            "expected dimension = a number, a word, or a text in quotes", node
        )


BASE = "base"
STATES = ("cycle", "mesh_cycles")
PLAIN = ("", "1")


class AmountError(ValueError):
    """A formula has no number on these runs; one sentence says why."""


class SeveralNumbersError(AmountError):
    """A formula has several numbers where one is wanted."""


def amount(text: str, grid: Any, units: str = "") -> float:
    """Return the number that a formula has on a campaign's dataset.

    Parameters
    ----------
    text : of the grammar of `wearlab.query.formula`
    grid : what `Store.open` returns; without a place along ``case``, the base counts
    units : that it is wanted in, "" for a plain number

    Raises
    ------
    AmountError : a name or a label is not there, units do not fit, no run has it, or
        several numbers remain
    """
    measured = parse_formula(text).worked_out(grid, {})
    value = one_number(measured, text)
    if value is None:
        raise AmountError(f"{text}: no stored run has it")
    return _converted(value, measured.units, units, text)


def one_number(measured: Measured, text: str) -> float | None:
    """Return the number that a formula has, None where it has none.

    Parameters
    ----------
    measured : what the formula comes to
    text : the formula, for the message

    Raises
    ------
    SeveralNumbersError : several numbers remain
    """
    values = np.unique(np.asarray(measured.values, float))
    values = values[np.isfinite(values)]
    if not values.size:
        return None
    if np.ptp(values) > 1e-12 * np.abs(values).max():
        dims = [
            f"{dim} ({size})" for dim, size in measured.values.sizes.items() if size > 1
        ]
        raise SeveralNumbersError(
            f"{text}: {values.size} numbers, not one: choose along {', '.join(dims)}"
        )
    return float(values[0])


def _converted(value: Any, unit: str, target: str, text: str) -> Any:
    if unit in PLAIN and target in PLAIN:
        return value
    try:
        return units.convert(value, unit or "1", target or "1")
    except units.UnitError as error:
        raise AmountError(f"{text}: {error}") from None


def _number(value: float, grid: Any, places: Places) -> Measured:
    import xarray as xr

    return Measured(xr.DataArray(value), "1")


def _placed(inner: WorkedOut, chosen: Places, grid: Any, places: Places) -> Measured:
    """Return a formula at places.

    Of every variable in it, the part along these dimensions.
    """
    return inner(grid, {**chosen, **places})


def _joined(
    sign: str, first: WorkedOut, second: WorkedOut, grid: Any, places: Places
) -> Measured:
    """Return a sum, a product or a ratio.

    A sum has the unit of its left side; of a product one side is plain.
    """
    (a, left) = first(grid, places)
    (b, right) = second(grid, places)
    if sign in "+-":
        units = right if left in PLAIN and not np.any(a) else left
        b = _converted(b, right, units, f"the two sides of {sign}")
        return Measured(a + b if sign == "+" else a - b, units)
    if right in PLAIN:
        return Measured(a * b if sign == "*" else a / b, left)
    if sign == "*" and left in PLAIN:
        return Measured(a * b, right)
    if sign == "/":
        return Measured(a / _converted(b, right, left, "the two sides of /"), "1")
    raise AmountError(
        f"a product of {left} and {right}: one side has to be a plain number"
    )


def _kept(
    inner: WorkedOut, condition: WorkedOut, grid: Any, places: Places
) -> Measured:
    """Return a formula where another is above zero, no number elsewhere."""
    values, units = inner(grid, places)
    return Measured(values.where(condition(grid, places).values > 0.0), units)


def _applied(
    function: str, inner: WorkedOut, dim: str | None, grid: Any, places: Places
) -> Measured:
    """Return a function of a formula, along one dimension or along all."""
    values, units = inner(grid, places)
    if function == "abs":
        return Measured(abs(values), units)
    if dim is not None and dim not in values.dims:
        raise AmountError(f"{function}(…, {dim}): {_not_there(dim, values.dims)}")
    if function in ("max", "min", "mean"):
        return Measured(getattr(values, function)(dim), units)
    if function == "sum":
        return Measured(values.sum(dim, min_count=1), units)
    if function == "range":
        return Measured(values.max(dim) - values.min(dim), units)
    at = (values if function == "largest_at" else -values).fillna(-np.inf).argmax(dim)
    if dim not in grid.coords:
        return Measured(at, "1")
    along = grid[dim]
    if along.dtype.kind not in "fiu":
        raise AmountError(f"{function}(…, {dim}): {dim} has names, not numbers")
    return Measured(
        along.isel({dim: at}).drop_vars(dim), str(along.attrs.get("units", "1"))
    )


def _variable(name: str, grid: Any, places: Places) -> Measured:
    if name not in grid.variables:
        raise AmountError(f"{name}: {_not_there(name, grid.variables)}")
    if grid[name].dtype.kind not in "fiub":
        raise AmountError(f"{name} holds text, not numbers")
    present = [
        candidate
        for candidate in (name, "n_updates", *STATES)
        if candidate in grid.variables
    ]
    part = grid[present].reset_coords()
    if "case" not in places and "case" in grid.coords and BASE in grid["case"].values:
        part = part.sel(case=BASE)
    for dim, label in places.items():
        part = _at(part, name, dim, label, grid)
    values = part[name].compute(scheduler="synchronous")
    return Measured(
        values.astype(float).reset_coords(drop=True),
        str(grid[name].attrs.get("units", "1")),
    )


def _at(part: Any, name: str, dim: str, label: Any, grid: Any) -> Any:
    """Return a variable, and what counts its states, at one place.

    The last wear state is each run's own.
    """
    if dim in STATES:
        if "update" not in part[name].dims or dim not in part:
            return part
        gaps = (
            abs(part[dim] - float(label))
            .fillna(np.inf)
            .compute(scheduler="synchronous")
        )
        return part.isel(update=gaps.argmin("update").reset_coords(drop=True))
    if dim not in part[name].dims and dim not in grid.dims:
        raise AmountError(f"{dim} = {label}: {_not_there(dim, grid.dims)}")
    if dim not in part.dims:
        return part
    if dim == "update":
        size = grid.sizes[dim]
        if not (
            isinstance(label, float) and label.is_integer() and -size <= label < size
        ):
            raise AmountError(
                f"update = {label}: it counts from 0 to {size - 1}, -1 is the last"
            )
        at = part["n_updates"] * (label < 0) + int(label)
        return part.isel(update=at.clip(min=0).reset_coords(drop=True))
    # without a coordinate counted from 0
    labels = list(grid[dim].values)
    attributes = grid[dim].attrs
    index = evaluate.index_of_quantity(
        label, labels, attributes.get("units"), attributes.get("key", "")
    )
    if index is None and dim in part[name].dims:
        raise AmountError(
            f"{dim} = {label}: {_not_there(str(label), map(str, labels))}"
        )
    return part if index is None else part.isel({dim: index})


def _not_there(name: str, names: Any) -> str:
    remedy = nearest.meant(name, [str(candidate) for candidate in names], "")
    return f"is not there{remedy}"
