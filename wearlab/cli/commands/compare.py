"""Two runs or two campaigns side by side: a table, a dataset and a figure."""

from functools import partial
from itertools import chain
from json import loads
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.cli import app, output
from wearlab.store import Store

if TYPE_CHECKING:
    import xarray as xr


NUMBERS: tuple[str, ...] = ("largest_relative_difference", "first_difference", "life", "service_life")
NUMBERS += ("relative_difference", "largest_value")
"""Variables of a comparison that JSON tells, as far as there are any."""


@app.command()
def compare(
    a: str,
    b: str,
    store: Store,
    on: str = "cycle",
    tolerance: float = 0.01,
    out: Path | None = None,
    figure: Path | None = None,
) -> output.Findings:
    """Compare two runs or two campaigns: what was asked and what came out differently.

    Parameters
    ----------
    a : A: A run (id or condition) or a campaign file.
    b : B: Another.
    on : WHAT: At the same cycle or wear_depth.
    tolerance : T: Relative difference that counts.
    out : FILE: Write the comparison as netCDF.
    figure : FILE: Draw it: PNG, SVG or PDF.
    """
    from wearlab.comparison import compare as compared

    if figure is not None and figure.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise output.Stop(f"--figure {figure}: a figure ends in .png, .svg or .pdf")
    left, right = (_meant(side, store) for side in (a, b))
    comparison = compared(left, right, on=on, tolerance=tolerance, store=store)  # type: ignore[arg-type]
    written = _write(comparison, out, figure)
    return output.Findings(partial(_content, comparison, written), chain(_text(comparison), written))


def _meant(word: str, store: Store) -> Any:
    """Return the campaign of a file, or else the full id of a run."""
    if Path(word).is_file() or word.endswith(".toml"):
        return output.read_campaign(word)
    return store.find(word).id


def _write(comparison: "xr.Dataset", data: Path | None, figure: Path | None) -> list[str]:
    from wearlab.report.plots import comparison_figure
    from wearlab.store import files, netcdf

    made = {} if data is None else {data: netcdf.to_image(comparison)[0]}
    if figure is not None:
        made[figure] = comparison_figure(comparison, figure.suffix[1:].lower())
    with output.refusing(OSError):
        for file, image in made.items():
            files.write_whole(file, image)
    return [*map(str, made)]


def _text(comparison: "xr.Dataset") -> output.Text:
    import numpy as np

    from wearlab.comparison import runs

    campaigns = "pair" in comparison.dims
    a, b = (comparison.attrs[f"{'campaign' if campaigns else 'run'}_{side}"] for side in "ab")
    yield f"A  {a}\nB  {b}\n"
    if rows := runs.scene_rows(comparison):
        title = "Asked differently, in every pair" if campaigns else "Asked differently"
        yield output.ShownTable(runs.SCENE_HEADS, rows, title)
    else:
        yield "No key of the scenes differs" + (" in every pair" if campaigns else "")
    yield ""
    along = comparison.attrs["aligned_on"].replace("_", " ")
    title = f"At the same {along}, tolerance {comparison.attrs['tolerance']:g}"
    if campaigns:
        yield output.ShownTable(runs.PAIR_HEADS, runs.pair_rows(comparison), title)
        for side in ("a", "b"):
            if left := loads(comparison.attrs.get(f"only_{side}", "[]")):
                yield f"\nonly in {side.upper()}: {'; '.join(left)}"
        return
    rows = runs.quantity_rows(comparison)
    yield output.ShownTable(runs.QUANTITY_HEADS, rows, title)
    first = comparison["first_difference"].values
    if np.isfinite(first).any():
        row = rows[int(np.nanargmin(first))]
        yield f"\nThey first differ by more than the tolerance at {row[-1]}: {row[0]}."
    else:
        yield "\nNowhere do they differ by more than the tolerance."


def _content(comparison: "xr.Dataset", written: list[str]) -> dict[str, Any]:
    from wearlab.store import description

    known = comparison.attrs.items()
    content: dict[str, Any] = {key: v for key, v in known if not key.startswith(("only_", "scene_"))}
    content["scene_differences"] = loads(comparison.attrs["scene_differences"])
    content["quantities"] = comparison["quantity"].values.tolist()
    content |= {name: description.plain(comparison[name].values) for name in NUMBERS if name in comparison}
    if "pair" in comparison.dims:
        names, ids = (comparison[name].values.tolist() for name in ("pair", "run_id"))
        content["pairs"] = [{"name": n, "runs": runs} for n, runs in zip(names, ids, strict=True)]
        content |= {side: loads(comparison.attrs.get(side, "[]")) for side in ("only_a", "only_b")}
    return {**content, "files": written}
