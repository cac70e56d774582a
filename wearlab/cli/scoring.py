"""``accuracy`` of a file whose scenes are drawn: how honest the error estimates are."""

import time
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.cli.output import Status, complain, refusing, say, show_json, show_table
from wearlab.cli.progress import bar, write_all

if TYPE_CHECKING:
    from wearlab.campaign import Drawing

TABLE, DATASET, FIGURE = "estimates.csv", "estimates.nc", "estimates.png"


def score_estimates(drawing: "Drawing", out: Path, workers: int | None, as_json: bool) -> Status:
    """Score the error estimates of drawn scenes; print tables, store the dataset and draw the figure."""
    from wearlab.accuracy import estimates, scores_table
    from wearlab.accuracy.dataset import netcdf
    from wearlab.accuracy.drawn import draw_any
    from wearlab.accuracy.scores_figure import scores_png
    from wearlab.simulation.provenance import provenance

    asked, begun = drawing.estimates, time.time()
    with refusing(OSError):
        out.mkdir(parents=True, exist_ok=True)
    made_by = provenance(draw_any(asked.seed, 0), begun)
    try:
        with bar(asked.scenes, as_json) as tell:
            rows = estimates.run(asked, made_by["source_hash"], out / TABLE, workers, tell)
    except KeyboardInterrupt:
        rows = estimates.done(asked, made_by["source_hash"], out / TABLE)
        complain(f"cut off after {len(rows)} of {asked.scenes} scenes: the same command goes on from there")
        if not rows:
            raise
    kept = ("model_version", "source", "source_hash", "packages", "machine", "commit", "dirty")
    made = scores_table.dataset(
        drawing.title, asked.seed, rows, {key: made_by[key] for key in kept if key in made_by}, begun
    )
    with refusing(OSError):
        files = write_all({DATASET: netcdf(made), FIGURE: scores_png(scores_table.scores_of(rows))}, out)
    missed = scores_table.missed(rows)
    if as_json:
        show_json(_content(rows, [out / TABLE, *files], missed))
    else:
        show_table(scores_table.SCORE_HEADS, scores_table.score_rows(rows), title="Error estimates")
        if apart := scores_table.apart_rows(rows):
            say()
            show_table(scores_table.APART_HEADS, apart, title=f"Scenes without a score, of {len(rows)}")
        say(f"\nestimates add {_share(rows)} to the time of a run")
        say(f"a run may take {asked.longest:g} s, its reference {asked.longest_reference:g} s\n")
        for path in (out / TABLE, *files):
            say(str(path))
    for line in missed:
        complain(line)
    return Status.TROUBLE if missed else Status.WELL


def _share(rows: list[dict[str, Any]]) -> str:
    from wearlab.accuracy.scores_table import costs

    median, largest = costs(rows)
    return f"{median:.0%} in the median and at most {largest:.0%}" if isfinite(median) else "nothing known"


def _content(rows: list[dict[str, Any]], files: list[Path], missed: list[str]) -> dict[str, Any]:
    from wearlab.accuracy import scores_table

    median, largest = scores_table.costs(rows)
    return {
        "scores": [
            dict(zip(scores_table.SCORE_HEADS, row, strict=True)) for row in scores_table.score_rows(rows)
        ],
        "apart": scores_table.reasons(rows),
        "cost": {"median": median, "largest": largest} if isfinite(median) else None,
        "missed": missed,
        "files": [str(path) for path in files],
    }
