"""What a measured flank's file says, as a campaign would read it: in words and as a figure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import Json
from wearlab.cli.output import Status, Stop, refusing, say, show_json
from wearlab.cli.registry import app


@app.command()
def profile(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A measured flank, as the machine wrote it.", show_default=False),
    ],
    columns: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=HEADER", help="Which header is meant, such as deviation=Abweichung."),
    ] = None,
    units: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=UNIT", help="A unit that the file does not tell, such as diameter=mm."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FIGURE", help="PNG, SVG or PDF.", show_default="FILE's name, .png")
    ] = None,
    json: Json = False,
) -> Status:
    """Draw a measured flank as it was understood, and say how the file was read."""
    from wearlab.figures.drawing import check_format, write
    from wearlab.figures.errors import FigureError
    from wearlab.figures.profile import profile_figure
    from wearlab.table_options import profile_table
    from wearlab.tables import TableError, read_table

    figure = out or Path(f"{file.stem}.png")
    mapped = _pairs(columns or [], "--columns")
    given = {"file": str(file), "columns": mapped, "units": _pairs(units or [], "--units")}
    with refusing(TableError, FigureError):
        ending = figure.suffix.lower().removeprefix(".")
        check_format(ending)
        table = read_table(file)
        x, y, abscissa, ordinate = profile_table(given, None)
        write(figure, profile_figure(file.name, (x, abscissa), (y, ordinate), table.understood, ending))
    headers = [str(table.meant(name, mapped)) for name in (x, y)]
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
        show_json(told)
    else:
        for name, text in told.items():
            if text:
                say(f"{name:<20}{text}")
    return Status.WELL


def _pairs(given: Sequence[str], option: str) -> dict[str, str]:
    pairs = [path.partition("=") for path in given]
    wrong = next(
        (path for path, (_, sign, text) in zip(given, pairs, strict=True) if not sign or not text), None
    )
    if wrong is not None:
        raise Stop(f"{option} {wrong}: write NAME=TEXT, such as deviation=Abweichung")
    return {name.strip(): text.strip() for name, _, text in pairs}
