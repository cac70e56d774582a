"""Figures that no campaign asks for: a comparison, a measured flank as it was understood."""

import json
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.comparison.states import phases_of
from wearlab.figures.plot import NAMES, Curve, LegendEntry, LineStyle, Panel, Pen, Plot
from wearlab.figures.render import rendered
from wearlab.figures.wording import converted, cycles, first_of, scaled

PENS = {"A": Pen(NAMES[0], "-", "o", 1.5), "B": Pen(NAMES[1], "--", "s", 1.0)}
WAVES = ("mesh_stiffness", "static_transmission_error", "dynamic_mesh_force")


def comparison_figure(comparison: xr.Dataset, ending: str = "png") -> bytes:
    """Return the figure of a comparison of two runs, or of two campaigns.

    Equal comparisons, equal bytes.

    Parameters
    ----------
    comparison : from `wearlab.comparison`
    ending : png, svg or pdf
    """
    plot = _campaigns(comparison) if "pair" in comparison.dims else _runs(comparison)
    said = {key: str(value) for key, value in comparison.attrs.items() if value}
    return rendered(plot, {"Title": plot.title, **said}, ending)


def _runs(comparison: xr.Dataset) -> Plot:
    panels = [*_over_life(comparison), *_waves(comparison)]
    lettered = (
        panel._replace(title=f"({chr(ord('a') + i)}) {panel.title}")
        for i, panel in enumerate(panels)
    )
    placed = [
        panel._replace(row=i // 2, column=i % 2) for i, panel in enumerate(lettered)
    ]
    ids = {
        side: comparison.attrs[f"run_{side.lower()}"][:10] or "unnamed" for side in PENS
    }
    legend = tuple(
        LegendEntry(f"{side}: run {run_id}", PENS[side], "line")
        for side, run_id in ids.items()
    )
    shape = -(-len(placed) // 2), min(2, len(placed))
    return Plot(
        "Two runs compared", tuple(placed), *shape, "none", legend, _notes(comparison)
    )


def _notes(comparison: xr.Dataset) -> tuple[str, ...]:
    changed = json.loads(comparison.attrs.get("scene_differences") or "[]")
    told = first_of(
        [f"{key['key']} {_said(key, 'a')} → {_said(key, 'b')}" for key in changed],
        6,
        "; ",
    )
    return (f"Asked differently: {told}." if told else "No key of the scenes differs.",)


def _said(difference: dict[str, object], side: str) -> str:
    value = difference[side]
    if value is None:
        return "absent"
    return (
        f"{value:.6g} {difference['units'] or ''}".rstrip()
        if isinstance(value, float)
        else str(value)
    )


def _over_life(comparison: xr.Dataset) -> Iterator[Panel]:
    """Yield the largest wear and how much everything differs, over cycles or depth."""
    if on_cycles := comparison.attrs["aligned_on"] == "cycle":
        (x,), across = scaled([comparison["cycle"].values], "wear cycles", "1")
    else:
        depth = converted(comparison["aligned_depth"].values, "m", "um")
        (x,), across = scaled([depth], "largest wear depth", "um")
    if on_cycles and "max_wear_depth" in comparison:
        values = comparison["max_wear_depth"].max("flank")
        yield _panel("largest wear depth", x, values, across, line="line-points")
    largest = (
        100.0 * comparison["relative_difference"].max("quantity", skipna=True).values
    )
    tolerance = 100.0 * float(comparison.attrs["tolerance"])
    limit = Curve(x, np.full(len(x), tolerance), Pen("#7a7a7a", ":"), "reference")
    differ = Curve(x, largest, Pen("#222222", "-", "o"), "line-points")
    title = "largest difference of all quantities (dotted: tolerance)"
    yield Panel(0, 0, title, across, "Difference (%)", (limit, differ))


def _waves(comparison: xr.Dataset) -> Iterator[Panel]:
    """Yield the waves over the mesh phase at the last common state, of the first mesh."""
    last = comparison.isel(state=-1)
    if comparison.attrs["aligned_on"] == "cycle":
        state = cycles(float(last["cycle"])).text
    else:
        state = f"{1e6 * float(last['aligned_depth']):.3g} µm worn"
    for name in WAVES:
        if name in comparison and "phase" in comparison[name].dims:
            wave = last[name].isel(mesh=0, missing_dims="ignore")
            title = f"{wave.attrs['long_name'].split(',')[0]}, {state}"
            yield _panel(title, phases_of(wave), wave, "Mesh phase")


def _panel(
    title: str, x: Array, values: xr.DataArray, across: str, line: LineStyle = "line"
) -> Panel:
    shown = values.attrs.get("display_units") or "1"
    sides = [
        converted(values.sel(run=side).values, values.attrs["units"], shown)
        for side in PENS
    ]
    both, label = scaled(sides, str(values.attrs["long_name"]).split(",")[0], shown)
    curves = tuple(
        Curve(x, y, pen, line) for y, pen in zip(both, PENS.values(), strict=True)
    )
    return Panel(0, 0, title, across, label, curves)


def _campaigns(comparison: xr.Dataset) -> Plot:
    """Return one dot for every pair and quantity: how much they differ at most."""
    shown = comparison.isel(pair=slice(40))
    share = 100.0 * shown["largest_relative_difference"].values
    names = [str(name) for name in shown["quantity_name"].values]
    told = (
        "max_wear_depth",
        *WAVES,
        "mesh_force_orders",
    )  # as many as can be told apart
    keep = [
        i for i, name in enumerate(shown["quantity"].values) if str(name) in told
    ] or [0]
    pen = {i: Pen(NAMES[k % len(NAMES)], "-", "o") for k, i in enumerate(keep)}
    curves = tuple(
        Curve(np.arange(1.0, len(share) + 1), share[:, i], pen[i], "line-points")
        for i in keep
    )
    title = (
        f"{comparison.attrs['campaign_a']} (A) and {comparison.attrs['campaign_b']} (B)"
    )
    panel = Panel(0, 0, "", "Pair of runs", "Largest difference (%)", curves)
    legend = tuple(LegendEntry(names[i], pen[i], "line-points") for i in keep)
    numbered = (
        "; ".join(f"{i}: {name}" for i, name in enumerate(shown["pair"].values, 1))
        + "."
    )
    return Plot(title, (panel,), 1, 1, "none", legend, (*_notes(comparison), numbered))


SHOWN = {
    "diameter": ("diameter", "m", "mm"),
    "roll_angle": ("roll angle", "rad", "deg"),
    "roll_length": ("length of roll", "m", "mm"),
    "path_position": ("position on the path of contact", "m", "mm"),
    "depth": ("wear depth", "m", "um"),
    "deviation": ("deviation, material missing downwards", "m", "um"),
}
Column = tuple[str, Sequence[float]]


def profile_figure(
    name: str, across: Column, up: Column, note: str, ending: str
) -> bytes:
    """Return the figure of a measured flank.

    Parameters
    ----------
    name : of the file
    across, up : abscissa and ordinate: what they are, and (n,) values [m] or [rad]
    note : how the file was read
    ending : png, svg or pdf
    """
    told = (
        (SHOWN[quantity], np.asarray(given, float)) for quantity, given in (across, up)
    )
    shown = (
        scaled([converted(v, stored, wanted)], words, wanted)
        for (words, stored, wanted), v in told
    )
    ((x,), x_label), ((y,), y_label) = shown
    look = "line-points" if len(across[1]) <= 60 else "line"
    curve = Curve(x, y, Pen("#0072B2", "-", "o"), look)  # type: ignore[arg-type]
    zero = Curve(x[[0, -1]], np.zeros(2), Pen("#7a7a7a", ":"), "reference")
    panel = Panel(0, 0, "", x_label, y_label, (zero, curve))
    plot = Plot(
        f"{name} as it was understood", (panel,), 1, 1, notes=(f"Read as {note}.",)
    )
    return rendered(plot, {"Title": plot.title}, ending)
