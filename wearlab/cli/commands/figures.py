"""``figures``, ``report``, ``profile`` and ``browse``: what people look at."""

import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from wearlab.cli import app, options, output
from wearlab.store import files, open_store

if TYPE_CHECKING:
    from wearlab.figures import drawing
    from wearlab.tables.p40 import Measurement


@app.command(
    help="Draw the figures of FILE from the stored runs, or a figure again from what "
    "its file says."
)
def figures(
    file: options.OptionalCampaignFile = None,
    store: options.StoreFolder = options.DEFAULT_STORE,
    out: Annotated[
        Path, options.option("--out", "Where the figures go.", "DIR")
    ] = Path("figures"),
    format: Annotated[
        str | None,
        options.option(
            "--format",
            "png, svg or pdf.",
            "FORMAT",
            show_default="png, or that of --from",
        ),
    ] = None,
    width: Annotated[
        str | None,
        options.option(
            "--width",
            "How wide, such as a column of 84mm; text stays as large as it is.",
            "LENGTH",
            show_default="as the panels need",
        ),
    ] = None,
    style: Annotated[
        Path | None,
        options.option(
            "--style",
            "Fonts and sizes: a style file of matplotlib (.mplstyle).",
            "FILE",
            show_default="wearlab's",
        ),
    ] = None,
    from_: Annotated[
        list[Path] | None,
        options.option(
            "--from", "Draw this figure again, by what its file says.", "FIGURE"
        ),
    ] = None,
) -> output.Findings:
    """Draw the figures of a campaign, or a figure again."""
    from wearlab.figures import drawing
    from wearlab.figures.paper import paper_of

    if (file is None) == (not from_):
        raise output.Stop("figures: give a campaign FILE, or --from FIGURE")
    with output.refusing(OSError):
        if format is not None:
            drawing.check_format(format)
        paper = paper_of(width, style)
        if file is None:
            redrawn = [
                drawing.redraw(figure, store, out, format, paper)
                for figure in from_ or []
            ]
            return _findings_of_redrawn(redrawn)
        campaign = output.read_drawable_campaign(file)
        with output.watched("figures"):
            drawn = output.draw_figures(campaign, store, out, format or "png", paper)
    paths = [str(path) for path in drawn.files]
    return output.Findings(paths, paths, drawn.ok)


def _findings_of_redrawn(redrawn: "Sequence[drawing.Redrawn]") -> output.Findings:
    """Return what became of figures drawn again: missing and stale runs."""
    content = [figure._asdict() | {"path": str(figure.path)} for figure in redrawn]
    ok = not any(figure.missing for figure in redrawn)
    return output.Findings(content, _redrawn_text(redrawn), ok)


def _redrawn_text(redrawn: "Sequence[drawing.Redrawn]") -> output.Text:
    """Yield whether each figure is the same.

    Which runs differ goes to standard error.
    """
    for figure in redrawn:
        if figure.same:
            yield f"{figure.path}: the same bytes"
        else:
            yield f"{figure.path}: differs from the figure it was drawn from"
        runs_by_problem = {
            "missing": figure.missing,
            "stale, made by other code": figure.stale,
            "computed again since the figure was drawn": figure.changed,
        }
        for problem, runs in runs_by_problem.items():
            if runs:
                output.complain(f"{problem}: {', '.join(runs)}")


@app.command(
    help="Write one self-contained page about FILE and its stored runs: HTML, or PDF "
    "by the name of OUT."
)
def report(
    file: options.CampaignFile,
    store: options.StoreFolder = options.DEFAULT_STORE,
    out: Annotated[
        Path | None,
        options.option(
            "--out", "The page (.html, .pdf).", "FILE", show_default="FILE.html"
        ),
    ] = None,
) -> output.Findings:
    """Write the page of a campaign."""
    from wearlab.report import page

    path = out or Path(f"{Path(file).stem}.html")
    page.check_suffix(path)
    campaign = output.read_campaign(file)
    with output.refusing(OSError), output.watched("figures"):
        files.write_whole(path, page.as_file(page.report(campaign, store), path.suffix))
    return output.Findings({"file": str(path)}, [str(path)])


@app.command()
def profile(
    file: Annotated[
        Path, options.argument("FILE", "A measured flank, as the machine wrote it.")
    ],
    columns: Annotated[
        list[str] | None,
        options.option(
            "--columns",
            "Which header is meant, such as deviation=Abweichung.",
            "NAME=HEADER",
        ),
    ] = None,
    units: Annotated[
        list[str] | None,
        options.option(
            "--units",
            "A unit that the file does not tell, such as diameter=mm.",
            "NAME=UNIT",
        ),
    ] = None,
    sheet: Annotated[
        str | None,
        options.option(
            "--sheet",
            "Which sheet of a workbook.",
            "NAME",
            show_default="the only one that holds a table",
        ),
    ] = None,
    decimal: Annotated[
        str | None,
        options.option(
            "--decimal",
            "The decimal sign, a point or a comma.",
            "SIGN",
            show_default="found out",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        options.option(
            "--out", "PNG, SVG or PDF.", "FIGURE", show_default="FILE's name, .png"
        ),
    ] = None,
) -> output.Findings:
    """Draw a measured flank as it was understood, and say how the file was read."""
    from wearlab.figures import drawing
    from wearlab.report import plots
    from wearlab.tables.measured_flank import measured_flank_of
    from wearlab.tables.p40 import is_measurement_file
    from wearlab.tables.written import table_named

    figure = out or Path(f"{file.stem}.png")
    headers_by_name = _pairs(columns or [], "--columns")
    settings = {
        "file": str(file),
        "columns": headers_by_name,
        "units": _pairs(units or [], "--units"),
        "sheet": sheet,
        "decimal": decimal,
    }
    ending = figure.suffix.lower().removeprefix(".")
    drawing.check_format(ending)
    if is_measurement_file(file):
        if columns or units or sheet or decimal:
            raise output.Stop(
                f"{file}: its codes tell quantities and units: leave out "
                "--columns, --units, --sheet and --decimal"
            )
        return _measured_gear(file, figure)

    table = table_named(settings, None)
    x, y, abscissa, ordinate, across = measured_flank_of(table, settings)
    image = plots.profile_figure(
        file.name, (x, abscissa), (y, ordinate), table.understood, ending
    )
    files.write_whole(figure, image)

    names = [x, y, "face_position"] if across else [x, y]
    headers = [str(table.column_of(name, headers_by_name)) for name in names]
    unused = [name for name in table.names if name not in headers]
    facts = {
        "file": str(file),
        "read as": table.understood,
        "x": f"{x}: column {headers[0]!r}, {len(abscissa)} values",
        "y": f"{y}: column {headers[1]!r}",
        "not used": ", ".join(unused),
        "above the headers": " | ".join(line.strip() for line in table.preamble),
        "figure": str(figure),
    }
    text = [f"{name:<20}{value}" for name, value in facts.items() if value]
    return output.Findings(facts, text)


def _measured_gear(file: Path, figure: Path) -> output.Findings:
    """Draw all curves of a measuring machine's file, and list what is there."""
    from wearlab.report import plots
    from wearlab.tables.p40 import SIDES, read_measurement

    measurement = read_measurement(file)
    facts = {"file": str(file), "gear": measurement.name}
    facts |= _values_by_code(measurement) if not measurement.traces else {}
    for kind in ("profile", "lead"):
        for side in SIDES:
            if teeth := measurement.teeth(kind, side):
                facts[f"{kind}, {side}"] = _extent(measurement, kind, side, teeth)
    for side, pitch in measurement.pitch.items():
        span = 1e6 * (pitch.cumulative.max() - pitch.cumulative.min())
        facts[f"pitch, {side}"] = f"{len(pitch.single)} teeth, F_p {span:.3f} um"
    elsewhere = sum(not trace.is_main for trace in measurement.traces)
    if elsewhere:
        facts["not used"] = f"{elsewhere} traces beside the teeth's own"

    has_curves = any(
        measurement.teeth(kind, side) for kind in ("profile", "lead") for side in SIDES
    )
    if measurement.traces and not has_curves:
        facts["not drawn"] = "there is no profile or lead of a tooth"
    elif measurement.traces:
        ending = figure.suffix.lower().removeprefix(".")
        files.write_whole(figure, plots.measurement_figure(measurement, ending))
        facts["figure"] = str(figure)
    text = [f"{name:<20}{value}" for name, value in facts.items() if value]
    return output.Findings(facts, text)


def _extent(
    measurement: "Measurement", kind: str, side: str, teeth: Sequence[int]
) -> str:
    """Return teeth, points and range of the curves of one side, in words."""
    places, deviation = measurement.curve(kind, side, "mean")
    ends = 1e3 * places[[0, -1]]
    where = f"face position {ends[0]:g} to {ends[1]:g} mm"
    if kind == "profile":
        radius = 1e3 * measurement.base_radius
        diameters = 2.0 * (ends**2 + radius**2) ** 0.5
        where = f"diameter {diameters[0]:.4f} to {diameters[1]:.4f} mm"
    lowest, highest = 1e6 * deviation.min(), 1e6 * deviation.max()
    return (
        f"teeth {', '.join(map(str, teeth))}; {len(places)} points, {where}; mean "
        f"{lowest:.3f} to {highest:.3f} um"
    )


def _values_by_code(measurement: "Measurement") -> dict[str, str]:
    """Return what a file of values holds, by its labels: left and right, or both."""
    from wearlab.tables.p40 import NO_VALUE

    return {
        f"{code} {measurement.labels[code]} ": ", ".join(
            NO_VALUE.get(number, f"{number:g}") for number in numbers
        )
        for code, numbers in measurement.codes.items()
        if numbers
    }


def _pairs(words: Sequence[str], option: str) -> dict[str, str]:
    """Return the NAME=TEXT pairs of an option."""
    pairs = {}
    for word in words:
        name, _, text = word.partition("=")
        if not text:
            raise output.Stop(
                f"{option} {word}: write NAME=TEXT, such as deviation=Abweichung"
            )
        pairs[name.strip()] = text.strip()
    return pairs


@app.command()
def browse(
    folder: Annotated[
        Path | None, options.argument("STORE", "The folder of the runs.")
    ] = None,
    store: options.StoreFolder = options.DEFAULT_STORE,
    port: Annotated[
        int,
        options.option(
            "--port",
            "Where it answers.",
            "N",
            min=0,
            max=65535,
            show_default="any free",
        ),
    ] = 0,
    no_open: Annotated[
        bool, options.option("--no-open", "Print the address, and open no browser.")
    ] = False,
    static: Annotated[
        Path | None,
        options.option("--static", "Write a copy of one campaign instead.", "DIR"),
    ] = None,
    campaign: Annotated[
        str | None,
        options.option(
            "--campaign",
            "With --static, which campaign.",
            "TITLE",
            show_default="the only one",
        ),
    ] = None,
) -> output.Findings | None:
    """Open a window on a store: look, choose, compare, in a browser on this machine."""
    from wearlab.browsing import window

    opened = open_store(folder or store.path)
    if static is not None:
        try:
            from wearlab.browsing import pages
        except ImportError as error:
            raise output.Stop(
                f"browse --static needs Bokeh ({error}): pip install 'wearlab[browse]'"
            ) from error

        with output.refusing(OSError), output.counted("pages") as report:
            path = str(pages.write_copy(opened, static, campaign, report))
        return output.Findings({"file": path}, [path])
    if campaign is not None:
        raise output.Stop("browse: --campaign goes with --static DIR")

    def announce(address: str) -> None:
        text = [f"{address}\nCtrl-C ends it"]
        output.write(output.Findings({"address": address}, text))
        if not no_open:
            webbrowser.open(address)

    window.Window(opened, port).run(announce)
    return None
