"""Compare two runs or two campaigns; measure error against run time."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from json import loads
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from wearlab.cli import app, options, output
from wearlab.store import Store, files

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.accuracy import study


NUMBERS: tuple[str, ...] = (
    "largest_relative_difference",
    "differs",
    "first_difference",
    "life",
    "life_estimate",
    "service_life",
    "relative_difference",
    "relative_estimate",
    "has_state",
    "largest_value",
)
"""Variables of a comparison that JSON has, as far as there are any."""
FIGURE_FORMATS = (".png", ".svg", ".pdf")


@app.command(
    help="Compare two runs or two campaigns: what was asked and what came out "
    "differently."
)
def compare(
    a: Annotated[
        str, options.argument("A", "A run (id or condition) or a campaign file.")
    ],
    b: Annotated[str, options.argument("B", "Another.")],
    store: options.StoreFolder = options.DEFAULT_STORE,
    on: Annotated[
        str, options.option("--on", "At the same cycle or wear_depth.", "WHAT")
    ] = "cycle",
    tolerance: Annotated[
        float, options.option("--tolerance", "Relative difference that counts.", "T")
    ] = 0.01,
    out: Annotated[
        Path | None,
        options.option("--out", "Write the comparison as netCDF.", "FILE"),
    ] = None,
    figure: Annotated[
        Path | None, options.option("--figure", "Draw it: PNG, SVG or PDF.", "FILE")
    ] = None,
) -> output.Findings:
    """Compare two runs or two campaigns."""
    from wearlab.comparison import compare as compare_runs

    if figure is not None and figure.suffix.lower() not in FIGURE_FORMATS:
        raise output.Stop(f"--figure {figure}: a figure ends in .png, .svg or .pdf")
    left = _campaign_or_run(a, store)
    right = _campaign_or_run(b, store)
    comparison = compare_runs(
        left,
        right,
        on=on,  # type: ignore[arg-type]
        tolerance=tolerance,
        store=store,
    )
    files_written = _write_comparison(comparison, out, figure)
    return output.Findings(
        partial(_comparison_content, comparison, files_written),
        chain(_comparison_text(comparison), files_written),
    )


def _campaign_or_run(word: str, store: Store) -> Any:
    """Return the campaign of a file, or else the full id of a run."""
    if Path(word).is_file() or word.endswith(".toml"):
        return output.read_campaign(word)
    return store.archive.find(word).id


def _write_comparison(
    comparison: "xr.Dataset", data: Path | None, figure: Path | None
) -> list[str]:
    """Write a comparison as netCDF and as a figure, and return the file names."""
    from wearlab.report.plots import comparison_figure
    from wearlab.store import netcdf

    with output.refusing(OSError):
        images = {} if data is None else {data: netcdf.to_image(comparison)[0]}
        if figure is not None:
            ending = figure.suffix[1:].lower()
            images[figure] = comparison_figure(comparison, ending)
        return _write_files(images)


def _write_files(images: Mapping[Path, bytes]) -> list[str]:
    """Write files, each whole or not at all, and return their names."""
    for file, image in images.items():
        files.write_whole(file, image)
    return [*map(str, images)]


def _comparison_text(comparison: "xr.Dataset") -> output.Text:
    """Yield what was asked differently, and what came out differently."""
    from wearlab.comparison import rows as tables

    attributes = comparison.attrs
    of_campaigns = "pair" in comparison.dims
    kind = "campaign" if of_campaigns else "run"
    yield f"A  {attributes[f'{kind}_a']}\nB  {attributes[f'{kind}_b']}\n"

    in_pairs = " in every pair" if of_campaigns else ""
    if rows := tables.scene_rows(comparison):
        title = f"Asked differently,{in_pairs}" if of_campaigns else "Asked differently"
        yield output.ShownTable(tables.SCENE_HEADS, rows, title)
    else:
        yield f"No key of the scenes differs{in_pairs}"
    yield ""

    along = attributes["aligned_on"].replace("_", " ")
    title = f"At the same {along}, tolerance {attributes['tolerance']:g}"
    if of_campaigns:
        yield output.ShownTable(tables.PAIR_HEADS, tables.pair_rows(comparison), title)
        for side in ("a", "b"):
            if unpaired := loads(attributes.get(f"only_{side}", "[]")):
                yield f"\nonly in {side.upper()}: {'; '.join(unpaired)}"
    else:
        rows = tables.quantity_rows(comparison)
        yield output.ShownTable(tables.QUANTITY_HEADS, rows, title)
        yield _first_difference(comparison, rows)
        yield from filter(None, [tables.states_text(comparison)])


def _first_difference(comparison: "xr.Dataset", rows: Sequence[Sequence[str]]) -> str:
    """Return where two runs first differ by more than the tolerance."""
    import numpy as np

    first = comparison["first_difference"].values
    if not np.isfinite(first).any():
        return "\nNowhere do they differ by more than tolerance and estimated error."
    row = rows[int(np.nanargmin(first))]
    return f"\nThey first differ by more than the tolerance at {row[-1]}: {row[0]}."


def _comparison_content(
    comparison: "xr.Dataset", files_written: list[str]
) -> dict[str, Any]:
    """Return a comparison as JSON has it."""
    from wearlab.store import description

    attributes = comparison.attrs
    content: dict[str, Any] = {
        key: value
        for key, value in attributes.items()
        if not key.startswith(("only_", "scene_"))
    }
    content["scene_differences"] = loads(attributes["scene_differences"])
    content["quantities"] = comparison["quantity"].values.tolist()
    for name in NUMBERS:
        if name in comparison:
            content[name] = description.plain(comparison[name].values)
    if "pair" in comparison.dims:
        names = comparison["pair"].values.tolist()
        ids = comparison["run_id"].values.tolist()
        content["pairs"] = [
            {"name": name, "runs": runs} for name, runs in zip(names, ids, strict=True)
        ]
        for side in ("only_a", "only_b"):
            content[side] = loads(attributes.get(side, "[]"))
    return {**content, "files": files_written}


@app.command()
def accuracy(
    file: options.CampaignFile,
    out: Annotated[
        Path, options.option("--out", "Where dataset and figures go.", "DIR")
    ] = Path("accuracy"),
    error: Annotated[
        float | None,
        options.option(
            "--error",
            "Relative error asked for.",
            "E",
            show_default="numerics.tolerance",
        ),
    ] = None,
) -> output.Findings:
    """Measure error against run time of FILE's scenes, beside other integrators."""
    campaign = output.read_campaign(file)
    from wearlab.accuracy import pages, study
    from wearlab.figures import render

    with output.refusing(OSError):
        out.mkdir(parents=True, exist_ok=True)
    begun = time.time()
    total = sum(study.expected_reports(case.scene) for case in campaign.cases)
    with output.bar(total) as advance:
        studies = [
            study.study(name, case.scene, partial(_report_step, advance, name))
            for name, case in zip(case_labels(campaign), campaign.cases, strict=True)
        ]

    dataset = study.dataset(campaign.title, studies, begun)
    texts = {
        "Title": dataset.attrs["title"],
        "runs": " ".join(dataset.run_id.values.tolist()),
    }
    with output.refusing(OSError):
        images = {out / "accuracy.nc": study.netcdf(dataset)}
        for name, page in pages.pages(dataset).items():
            images[out / f"{name}.png"] = render.rendered(page, texts)
        paths = _write_files(images)
    return output.Findings(
        _accuracy_content(studies, error, paths),
        _accuracy_text(studies, error, paths),
        any(result.curves for result in studies),
        [f"{result.label}: {note}" for result in studies for note in result.notes],
    )


def _report_step(advance: Callable[[str], None], case: str, step: str) -> None:
    """Report that a step of a case is done."""
    advance(f"{case}: {step}")


def case_labels(campaign: Any) -> list[str]:
    """Return short names: the place on the axes where there is one, else the label."""
    full = [output.case_name(campaign, case) for case in campaign.cases]
    short = [name.partition("(")[2].rstrip(")") or name for name in full]
    if len(campaign.axes) == 1:
        short = [name.rpartition("=")[2] for name in short]
    return short if len(set(short)) == len(short) else full


def _accuracy_text(
    studies: "list[study.Study]", error: float | None, files: list[str]
) -> output.Text:
    """Yield tables of error against run time, and the files."""
    from wearlab.accuracy import pages, peer_curves

    for title, (heads, rows) in pages.tables(studies, error).items():
        if rows:
            yield from ("", output.ShownTable(heads, rows, title))
    if peers := ", ".join(peer_curves.missing_peers()):
        yield f'\nnot installed: {peers} (the extra "peers")'
    yield from ("", *files)


def _accuracy_content(
    studies: "list[study.Study]", error: float | None, files: list[str]
) -> dict[str, Any]:
    """Return tables and curves of error against run time as JSON has them."""
    from wearlab.accuracy import pages

    tables = {}
    for title, (heads, rows) in pages.tables(studies, error).items():
        tables[title] = [dict(zip(heads, row, strict=True)) for row in rows]
    points = [point for result in studies for point in _curve_points(result)]
    return {**tables, "curves": points, "files": files}


def _curve_points(measured: "study.Study") -> Iterator[dict[str, Any]]:
    """Yield every setting of every curve as plain numbers, None where not finite."""
    for curve in measured.curves:
        curve_attributes = {
            "name": curve.name,
            "knob": curve.knob,
            "quantity": curve.quantity,
            "role": curve.role,
            "fixed": curve.fixed,
        }
        for rung in curve.rungs:
            numbers = {
                key: value if isfinite(value) else None
                for key, value in rung._asdict().items()
            }
            yield {"case": measured.label, **curve_attributes, **numbers}
