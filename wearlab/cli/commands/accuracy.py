"""Error against run time of a campaign's scenes."""

import time
from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.cli import app, output

if TYPE_CHECKING:
    from wearlab.accuracy import study
    from wearlab.campaign import Campaign


@app.command()
def accuracy(file: str, out: Path = Path("accuracy"), error: float | None = None) -> output.Findings:
    """Measure error against run time of FILE's scenes, beside other integrators.

    Parameters
    ----------
    out : DIR: Where dataset and figures go.
    error : E [numerics.tolerance]: Relative error asked for.
    """
    campaign = output.read_campaign(file)
    from wearlab.accuracy import study

    with output.refusing(OSError):
        out.mkdir(parents=True, exist_ok=True)
    begun = time.time()
    total = sum(study.expected_reports(case.scene) for case in campaign.cases)
    with output.bar(total) as tell:
        studies = [
            study.study(name, case.scene, lambda what, name=name: tell(f"{name}: {what}"))  # type: ignore[misc]
            for name, case in zip(_labels(campaign), campaign.cases, strict=True)
        ]
    made = study.dataset(campaign.title, studies, begun)
    with output.refusing(OSError):
        files = _write(made, out)
    notes = [f"{one.label}: {note}" for one in studies for note in one.notes]
    content, text = _content(studies, error, files), _text(studies, error, files)
    return output.Findings(content, text, any(one.curves for one in studies), notes)


def _labels(campaign: "Campaign") -> list[str]:
    """Return short names: the place on the axes where there is one, else the label."""
    full = [output.case_name(campaign, case) for case in campaign.cases]
    short = [name.partition("(")[2].rstrip(")") or name for name in full]
    if len(campaign.axes) == 1:
        short = [name.rpartition("=")[2] for name in short]
    return short if len(set(short)) == len(short) else full


def _write(made: Any, out: Path) -> list[Path]:
    """Write the dataset and its figures, each whole or not at all."""
    from wearlab.accuracy import pages, study
    from wearlab.figures.render import rendered
    from wearlab.store.files import write_whole

    texts = {"Title": made.attrs["title"], "runs": " ".join(made.run_id.values.tolist())}
    images = {f"{file}.png": rendered(plot, texts) for file, plot in pages.pages(made).items()}
    for file, image in (contents := {"accuracy.nc": study.netcdf(made), **images}).items():
        write_whole(out / file, image)
    return [out / file for file in contents]


def _text(studies: "list[study.Study]", error: float | None, files: list[Path]) -> output.Text:
    from wearlab.accuracy import curves, pages

    for title, (heads, rows) in pages.tables(studies, error).items():
        if rows:
            yield from ("", output.ShownTable(heads, rows, title))
    if curves.missing_peers():
        yield f'\nnot installed: {", ".join(curves.missing_peers())} (the extra "peers")'
    yield from ("", *map(str, files))


def _content(studies: "list[study.Study]", error: float | None, files: list[Path]) -> dict[str, Any]:
    from wearlab.accuracy import pages

    told = {}
    for title, (heads, rows) in pages.tables(studies, error).items():
        told[title] = [dict(zip(heads, row, strict=True)) for row in rows]
    curves = [row for one in studies for row in _rungs(one)]
    return {**told, "curves": curves, "files": [str(path) for path in files]}


def _rungs(measured: "study.Study") -> Iterator[dict[str, Any]]:
    """Yield every setting of every curve as plain numbers, times in seconds; None: not finite."""
    for curve in measured.curves:
        named = {name: getattr(curve, name) for name in ("name", "knob", "quantity", "role", "fixed")}
        for rung in curve.rungs:
            numbers = {key: value if isfinite(value) else None for key, value in rung._asdict().items()}
            yield {"case": measured.label, **named, **numbers}
