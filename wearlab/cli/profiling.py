"""``profile``: a measured flank as a campaign would read it, in words and as a figure."""

from collections.abc import Sequence
from pathlib import Path

from wearlab.cli.output import Status, Stop, refusing, say, show_json


def draw_profile(
    file: Path, columns: Sequence[str], units: Sequence[str], out: Path | None, as_json: bool
) -> Status:
    """Draw a measured flank and say how its file was read.

    Parameters
    ----------
    file : as the machine wrote it
    columns, units : quantity=header and quantity=unit, where the file does not tell them itself
    out : the figure [the file's name with .png, here]
    as_json : print for machines
    """
    from wearlab.figures.drawing import check_format, write
    from wearlab.figures.errors import FigureError
    from wearlab.figures.profile import profile_figure
    from wearlab.machine_table import MachineTableError, machine_table
    from wearlab.tables import TableError, profile_table

    figure = out or Path(f"{file.stem}.png")
    mapped = _pairs(columns, "--columns")
    given = {"file": str(file), "columns": mapped, "units": _pairs(units, "--units")}
    with refusing(MachineTableError, TableError, FigureError):
        ending = figure.suffix.lower().removeprefix(".")
        check_format(ending)
        table = machine_table(file)
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
    if as_json:
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
