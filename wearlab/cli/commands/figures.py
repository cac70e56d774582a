"""``figures``, ``report`` and ``profile``: pictures of a campaign, its page, and a measured flank."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearlab.cli import campaigns, output, registry
from wearlab.store import Store

if TYPE_CHECKING:
    from wearlab.figures.drawing import Redrawn


@registry.command()
def figures(
    file: Annotated[
        str | None, typer.Argument(metavar="FILE", help="A campaign file (TOML).", show_default=False)
    ] = None,
    folder: registry.StoreFolder = registry.STORE,
    out: Path = Path("figures"),
    format: str = "png",
    from_: list[Path] | None = None,
    json: registry.Json = False,
) -> output.Status:
    """Draw the figures of FILE from the stored runs, or a figure again from what its file says.

    Parameters
    ----------
    out : DIR: Where the figures go.
    format : FORMAT: png, svg or pdf.
    from_ : FIGURE: Draw this figure again, by what its file says.
    """
    if from_ and file is None:
        return redraw_figures(from_, Store(folder), out, json)
    if file is None or from_:
        raise output.Stop("figures: give a campaign FILE, or --from FIGURE")
    return draw_figures(file, Store(folder), out, format, json)


def draw_figures(file: str, store: "Store", out: Path, ending: str, as_json: bool) -> output.Status:
    """Draw the figures of a campaign from its stored runs."""
    from wearlab.figures import FigureError, draw
    from wearlab.figures.drawing import check_format

    check_format(ending)
    campaign = campaigns.sound_campaign(file)
    status = output.Status.WELL
    with output.refusing(OSError):
        try:
            drawn = tuple(draw(campaign, store, out, ending))
        except FigureError as error:
            output.complain(str(error))
            drawn, status = error.drawn, output.Status.TROUBLE
    if as_json:
        output.show_json([str(path) for path in drawn])
    else:
        for path in drawn:
            output.say(str(path))
    return status


def redraw_figures(figures: Sequence[Path], store: "Store", out: Path, as_json: bool) -> output.Status:
    """Draw figures again from the store, and say which of their runs are missing or stale."""
    from wearlab.figures import redraw

    with output.refusing(OSError):
        drawn = [redraw(figure, store, out) for figure in figures]
    if as_json:
        output.show_json([{**vars(redrawn), "path": str(redrawn.path)} for redrawn in drawn])
    else:
        for redrawn in drawn:
            _tell(redrawn)
    return output.Status.TROUBLE if any(redrawn.missing for redrawn in drawn) else output.Status.WELL


def _tell(drawn: "Redrawn") -> None:
    output.say(
        f"{drawn.path}: {'the same bytes' if drawn.same else 'differs from the figure it was drawn from'}"
    )
    for words, runs in (
        ("missing", drawn.missing),
        ("stale, made by other code", drawn.stale),
        ("computed again since the figure was drawn", drawn.changed),
    ):
        if runs:
            output.complain(f"{words}: {', '.join(runs)}")


@registry.command()
def report(
    file: registry.File,
    folder: registry.StoreFolder = registry.STORE,
    out: Path | None = None,
    json: registry.Json = False,
) -> output.Status:
    """Write one self-contained page about FILE and its stored runs: HTML, or PDF by the name of OUT.

    Parameters
    ----------
    out : FILE [FILE.html]: The page (.html, .pdf).
    """
    from wearlab.report.page import as_file, check_suffix
    from wearlab.report.page import report as page_of
    from wearlab.store import files

    path = out or Path(f"{Path(file).stem}.html")
    check_suffix(path)
    store, campaign = Store(folder), output.read_campaign(file)
    with output.refusing(OSError):
        files.write_whole(path, as_file(page_of(campaign, store), path.suffix))
    if json:
        output.show_json({"file": str(path)})
    else:
        output.say(str(path))
    return output.Status.WELL


@registry.command()
def profile(
    file: Path,
    columns: list[str] | None = None,
    units: list[str] | None = None,
    out: Path | None = None,
    json: registry.Json = False,
) -> output.Status:
    """Draw a measured flank as it was understood, and say how the file was read.

    Parameters
    ----------
    file : FILE: A measured flank, as the machine wrote it.
    columns : NAME=HEADER: Which header is meant, such as deviation=Abweichung.
    units : NAME=UNIT: A unit that the file does not tell, such as diameter=mm.
    out : FIGURE [FILE's name, .png]: PNG, SVG or PDF.
    """
    from wearlab.figures.drawing import check_format, write
    from wearlab.report.plots import profile_figure
    from wearlab.table_options import profile_table
    from wearlab.tables import read_table

    figure = out or Path(f"{file.stem}.png")
    mapped = _pairs(columns or [], "--columns")
    given = {"file": str(file), "columns": mapped, "units": _pairs(units or [], "--units")}
    ending = figure.suffix.lower().removeprefix(".")
    check_format(ending)
    table = read_table(file)
    x, y, abscissa, ordinate, across = profile_table(given, None)
    write(figure, profile_figure(file.name, (x, abscissa), (y, ordinate), table.understood, ending))
    headers = [str(table.meant(name, mapped)) for name in (x, y, *(["face_position"] if across else []))]
    told = {
        "file": str(file),
        "read as": table.understood,
        "x": f"{x}: column {headers[0]!r}, {len(abscissa)} values",
        "y": f"{y}: column {headers[1]!r}",
        "not used": ", ".join(name for name in table.names if name not in headers),
        "above the headers": " | ".join(line.strip() for line in table.preamble),
        "figure": str(figure),
    }
    if json:
        output.show_json(told)
    else:
        for name, text in told.items():
            if text:
                output.say(f"{name:<20}{text}")
    return output.Status.WELL


def _pairs(given: Sequence[str], option: str) -> dict[str, str]:
    pairs = [path.partition("=") for path in given]
    wrong = next(
        (path for path, (_, sign, text) in zip(given, pairs, strict=True) if not sign or not text), None
    )
    if wrong is not None:
        raise output.Stop(f"{option} {wrong}: write NAME=TEXT, such as deviation=Abweichung")
    return {name.strip(): text.strip() for name, _, text in pairs}
