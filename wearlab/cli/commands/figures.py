"""Pictures of a campaign, its page, a measured flank, and a window on a store in a browser."""

import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.cli import app, output
from wearlab.store import Store, files, open_store

if TYPE_CHECKING:
    from wearlab.figures import drawing


@app.command()
def figures(
    file: str | None = None,
    *,
    store: Store,
    out: Path = Path("figures"),
    format: str = "png",
    from_: list[Path] | None = None,
) -> output.Findings:
    """Draw the figures of FILE from the stored runs, or a figure again from what its file says.

    Parameters
    ----------
    file : [FILE]: A campaign file (TOML).
    out : DIR: Where the figures go.
    format : FORMAT: png, svg or pdf.
    from_ : FIGURE: Draw this figure again, by what its file says.
    """
    from wearlab.figures import drawing

    if (file is None) == (not from_):
        raise output.Stop("figures: give a campaign FILE, or --from FIGURE")
    with output.refusing(OSError):
        if file is None:
            return _drawn_again(from_ or [], store, out)
        drawing.check_format(format)
        drawn, well = output.drawn(output.sound_campaign(file), store, out, format)
    paths = [str(path) for path in drawn]
    return output.Findings(paths, paths, well)


def _drawn_again(figures: Sequence[Path], store: Store, out: Path) -> output.Findings:
    """Draw figures again from the store, and say which of their runs are missing or stale."""
    from wearlab.figures import redraw

    drawn = [redraw(figure, store, out) for figure in figures]
    content = [redrawn._asdict() | {"path": str(redrawn.path)} for redrawn in drawn]
    return output.Findings(
        content, _text(drawn), not any(redrawn.missing for redrawn in drawn)
    )


def _text(drawn: "Sequence[drawing.Redrawn]") -> output.Text:
    for one in drawn:
        yield (
            f"{one.path}: "
            f"{'the same bytes' if one.same else 'differs from the figure it was drawn from'}"
        )
        told = {"missing": one.missing, "stale, made by other code": one.stale}
        for words, runs in (
            told | {"computed again since the figure was drawn": one.changed}
        ).items():
            if runs:
                output.complain(f"{words}: {', '.join(runs)}")


@app.command()
def report(file: str, store: Store, out: Path | None = None) -> output.Findings:
    """Write one self-contained page about FILE and its stored runs: HTML, or PDF by the name of OUT.

    Parameters
    ----------
    out : FILE [FILE.html]: The page (.html, .pdf).
    """
    from wearlab.report import page

    path = out or Path(f"{Path(file).stem}.html")
    page.check_suffix(path)
    campaign = output.read_campaign(file)
    with output.refusing(OSError):
        files.write_whole(path, page.as_file(page.report(campaign, store), path.suffix))
    return output.Findings({"file": str(path)}, [str(path)])


@app.command()
def profile(
    file: Path,
    columns: list[str] | None = None,
    units: list[str] | None = None,
    out: Path | None = None,
) -> output.Findings:
    """Draw a measured flank as it was understood, and say how the file was read.

    Parameters
    ----------
    file : FILE: A measured flank, as the machine wrote it.
    columns : NAME=HEADER: Which header is meant, such as deviation=Abweichung.
    units : NAME=UNIT: A unit that the file does not tell, such as diameter=mm.
    out : FIGURE [FILE's name, .png]: PNG, SVG or PDF.
    """
    from wearlab import tables
    from wearlab.figures import drawing
    from wearlab.report import plots
    from wearlab.tables.measured_flank import read_measured_flank

    figure = out or Path(f"{file.stem}.png")
    mapped = _pairs(columns or [], "--columns")
    given = {
        "file": str(file),
        "columns": mapped,
        "units": _pairs(units or [], "--units"),
    }
    drawing.check_format(ending := figure.suffix.lower().removeprefix("."))
    table = tables.read_table(file)
    x, y, abscissa, ordinate, across = read_measured_flank(given)
    drawn = plots.profile_figure(
        file.name, (x, abscissa), (y, ordinate), table.understood, ending
    )
    files.write_whole(figure, drawn)
    headers = [
        str(table.column_of(name, mapped))
        for name in (x, y, *(["face_position"] if across else []))
    ]
    told = {"file": str(file), "read as": table.understood}
    told |= {
        "x": f"{x}: column {headers[0]!r}, {len(abscissa)} values",
        "y": f"{y}: column {headers[1]!r}",
    }
    told["not used"] = ", ".join(name for name in table.names if name not in headers)
    told["above the headers"] = " | ".join(line.strip() for line in table.preamble)
    told["figure"] = str(figure)
    return output.Findings(
        told, [f"{name:<20}{text}" for name, text in told.items() if text]
    )


def _pairs(given: Sequence[str], option: str) -> dict[str, str]:
    pairs = {}
    for words in given:
        name, _, text = words.partition("=")
        if not text:
            raise output.Stop(
                f"{option} {words}: write NAME=TEXT, such as deviation=Abweichung"
            )
        pairs[name.strip()] = text.strip()
    return pairs


@app.command()
def browse(
    folder: Path | None = None,
    *,
    store: Store,
    port: int = 0,
    no_open: bool = False,
    static: Path | None = None,
    campaign: str | None = None,
) -> output.Findings | None:
    """Open a window on a store: look, choose, compare, in a browser on this machine.

    Parameters
    ----------
    folder : [STORE]: The folder of the runs.
    port : N from 0 to 65535 [any free]: Where it answers.
    no_open : Print the address, and open no browser.
    static : DIR: Write a copy of one campaign instead.
    campaign : TITLE [the only one]: With --static, which campaign.
    """
    from wearlab.browsing import window

    own = open_store(folder or store.path)
    if static is not None:
        from wearlab.browsing import pages

        with output.refusing(OSError):
            made = str(pages.write_copy(own, static, campaign))
        return output.Findings({"file": made}, [made])
    if campaign is not None:
        raise output.Stop("browse: --campaign goes with --static DIR")

    def ready(address: str) -> None:
        output.tell(
            output.Findings({"address": address}, [f"{address}\nCtrl-C ends it"])
        )
        if not no_open:
            webbrowser.open(address)

    window.Window(own, port).run(ready)
    return None
