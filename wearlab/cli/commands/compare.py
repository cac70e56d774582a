"""Side by side: two runs, two campaigns, or the error of a campaign's scenes against run time."""

import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import chain
from json import loads
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.cli import app, output
from wearlab.store import Store, files

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.accuracy import study


NUMBERS: tuple[str, ...] = (
    "largest_relative_difference",
    "first_difference",
    "life",
    "service_life",
)
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
    left = _meant(a, store)
    right = _meant(b, store)
    comparison = compared(left, right, on=on, tolerance=tolerance, store=store)  # type: ignore[arg-type]
    written = _write(comparison, out, figure)
    return output.Findings(
        partial(_content, comparison, written), chain(_text(comparison), written)
    )


def _meant(word: str, store: Store) -> Any:
    """Return the campaign of a file, or else the full id of a run."""
    if Path(word).is_file() or word.endswith(".toml"):
        return output.read_campaign(word)
    return store.archive.find(word).id


def _write(
    comparison: "xr.Dataset", data: Path | None, figure: Path | None
) -> list[str]:
    from wearlab.report.plots import comparison_figure
    from wearlab.store import netcdf

    with output.refusing(OSError):
        made = {} if data is None else {data: netcdf.to_image(comparison)[0]}
        if figure is not None:
            made[figure] = comparison_figure(comparison, figure.suffix[1:].lower())
        return _written(made)


def _written(images: Mapping[Path, bytes]) -> list[str]:
    """Write files, each whole or not at all, and return their names."""
    for file, image in images.items():
        files.write_whole(file, image)
    return [*map(str, images)]


def _text(comparison: "xr.Dataset") -> output.Text:
    import numpy as np

    from wearlab.comparison import rows as tables

    campaigns = "pair" in comparison.dims
    a, b = (
        comparison.attrs[f"{'campaign' if campaigns else 'run'}_{side}"]
        for side in "ab"
    )
    yield f"A  {a}\nB  {b}\n"
    if rows := tables.scene_rows(comparison):
        title = "Asked differently, in every pair" if campaigns else "Asked differently"
        yield output.ShownTable(tables.SCENE_HEADS, rows, title)
    else:
        yield "No key of the scenes differs" + (" in every pair" if campaigns else "")
    yield ""
    along = comparison.attrs["aligned_on"].replace("_", " ")
    title = f"At the same {along}, tolerance {comparison.attrs['tolerance']:g}"
    if campaigns:
        yield output.ShownTable(tables.PAIR_HEADS, tables.pair_rows(comparison), title)
        for side in ("a", "b"):
            if left := loads(comparison.attrs.get(f"only_{side}", "[]")):
                yield f"\nonly in {side.upper()}: {'; '.join(left)}"
        return
    rows = tables.quantity_rows(comparison)
    yield output.ShownTable(tables.QUANTITY_HEADS, rows, title)
    first = comparison["first_difference"].values
    if np.isfinite(first).any():
        row = rows[int(np.nanargmin(first))]
        yield f"\nThey first differ by more than the tolerance at {row[-1]}: {row[0]}."
    else:
        yield "\nNowhere do they differ by more than the tolerance."


def _content(comparison: "xr.Dataset", written: list[str]) -> dict[str, Any]:
    from wearlab.store import description

    known = comparison.attrs.items()
    content: dict[str, Any] = {
        key: v for key, v in known if not key.startswith(("only_", "scene_"))
    }
    content["scene_differences"] = loads(comparison.attrs["scene_differences"])
    content["quantities"] = comparison["quantity"].values.tolist()
    content |= {
        name: description.plain(comparison[name].values)
        for name in NUMBERS
        if name in comparison
    }
    if "pair" in comparison.dims:
        names = comparison["pair"].values.tolist()
        ids = comparison["run_id"].values.tolist()
        content["pairs"] = [
            {"name": n, "runs": runs} for n, runs in zip(names, ids, strict=True)
        ]
        content |= {
            side: loads(comparison.attrs.get(side, "[]"))
            for side in ("only_a", "only_b")
        }
    return {**content, "files": written}


@app.command()
def accuracy(
    file: str, out: Path = Path("accuracy"), error: float | None = None
) -> output.Findings:
    """Measure error against run time of FILE's scenes, beside other integrators.

    Parameters
    ----------
    out : DIR: Where dataset and figures go.
    error : E [numerics.tolerance]: Relative error asked for.
    """
    campaign = output.read_campaign(file)
    from wearlab.accuracy import pages, study
    from wearlab.figures import render

    with output.refusing(OSError):
        out.mkdir(parents=True, exist_ok=True)
    begun = time.time()
    total = sum(study.expected_reports(case.scene) for case in campaign.cases)
    with output.bar(total) as tell:
        studies = []
        for name, case in zip(_labels(campaign), campaign.cases, strict=True):
            studies.append(
                study.study(name, case.scene, partial(_report_of, tell, name))
            )
    made = study.dataset(campaign.title, studies, begun)
    texts = {
        "Title": made.attrs["title"],
        "runs": " ".join(made.run_id.values.tolist()),
    }
    with output.refusing(OSError):
        images = {out / "accuracy.nc": study.netcdf(made)}
        images |= {
            out / f"{file}.png": render.rendered(p, texts)
            for file, p in pages.pages(made).items()
        }
        written = _written(images)
    notes = [f"{one.label}: {note}" for one in studies for note in one.notes]
    content = _accuracy_content(studies, error, written)
    text = _accuracy_text(studies, error, written)
    return output.Findings(content, text, any(one.curves for one in studies), notes)


def _report_of(tell: Callable[[str], None], case: str, step: str) -> None:
    """Say which step of which case is done."""
    tell(f"{case}: {step}")


def _labels(campaign: Any) -> list[str]:
    """Return short names: the place on the axes where there is one, else the label."""
    full = [output.case_name(campaign, case) for case in campaign.cases]
    short = [name.partition("(")[2].rstrip(")") or name for name in full]
    if len(campaign.axes) == 1:
        short = [name.rpartition("=")[2] for name in short]
    return short if len(set(short)) == len(short) else full


def _accuracy_text(
    studies: "list[study.Study]", error: float | None, files: list[str]
) -> output.Text:
    from wearlab.accuracy import curves, pages

    for title, (heads, rows) in pages.tables(studies, error).items():
        if rows:
            yield from ("", output.ShownTable(heads, rows, title))
    if curves.missing_peers():
        yield (
            f'\nnot installed: {", ".join(curves.missing_peers())} (the extra "peers")'
        )
    yield from ("", *files)


def _accuracy_content(
    studies: "list[study.Study]", error: float | None, files: list[str]
) -> dict[str, Any]:
    from wearlab.accuracy import pages

    told = {}
    for title, (heads, rows) in pages.tables(studies, error).items():
        told[title] = [dict(zip(heads, row, strict=True)) for row in rows]
    return {
        **told,
        "curves": [row for one in studies for row in _rungs(one)],
        "files": files,
    }


def _rungs(measured: "study.Study") -> Iterator[dict[str, Any]]:
    """Yield every setting of every curve as plain numbers, times in seconds.

    None: not finite.
    """
    for curve in measured.curves:
        named = {
            name: getattr(curve, name)
            for name in ("name", "knob", "quantity", "role", "fixed")
        }
        for rung in curve.rungs:
            numbers = {
                key: value if isfinite(value) else None
                for key, value in rung._asdict().items()
            }
            yield {"case": measured.label, **named, **numbers}
