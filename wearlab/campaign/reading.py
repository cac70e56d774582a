"""A campaign file, or a table that says the same, becomes a campaign."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from wearlab import nearest, units
from wearlab.campaign import axes, campaign, case, cases, claims, json_schema, update
from wearlab.campaign.blocks import (
    CampaignError,
    attempt,
    blocks_of,
    is_list_of,
    modelled,
)
from wearlab.campaign.inheritance import (
    PLUGINS,
    Inherited,
    Layer,
    inherit,
    over_parents,
)
from wearlab.campaign.toml_file import plain
from wearlab.campaign.update_options import SECTION, UpdateSpec
from wearlab.plugins import Plugin, PluginError, use, values_of
from wearlab.query.keys import flat
from wearlab.scene import merge, oversights
from wearlab.scene.problems import shown
from wearlab.scene.sections import Sections

IN_MEMORY = Path("campaign")
"""What errors call a campaign that is no file."""
MAX_QUANTITIES_OF_KEY = 100
NOT_OF_SCENES = (
    "title",
    "reference",
    "figure",
    "claim",
    "sweep",
    "case",
    "metadata",
    "report",
    "exclude",
)


def load(path: str | Path | Mapping[str, Any]) -> campaign.Campaign:
    """Read a campaign file, with all that it extends, or a table that says the same.

    Parameters
    ----------
    path : a TOML file; or a mapping of its keys, whose paths start from the current
        folder

    Returns
    -------
    Campaign

    Raises
    ------
    CampaignError
        When anything in it is wrong; every fault is one line with file, path, value and
        remedy.
    """
    if isinstance(path, Mapping):
        file = None
        inherited = over_parents(plain(path), IN_MEMORY, Path.cwd())
    else:
        file = Path(path).expanduser().resolve()
        inherited = inherit(file)
    with _naming_files(inherited):
        return _read(inherited, file)


def read_plugins(path: str | Path) -> tuple[Plugin, ...]:
    """Make the variants of a file's plug-ins known; read nothing else of the file.

    Plug-ins of files that it extends are among them.

    Parameters
    ----------
    path : a TOML file

    Raises
    ------
    CampaignError
        When it cannot be read, or a plug-in may not be run and nothing is known of it.
    """
    inherited = inherit(Path(path).expanduser().resolve())
    with _naming_files(inherited):
        return _use_plugins(inherited.table.get(PLUGINS, []))


@contextmanager
def _naming_files(inherited: Inherited) -> Iterator[None]:
    """Put in front of every problem the file that wrote what the problem is about."""
    try:
        yield
    except CampaignError as error:
        raise CampaignError(
            f"{inherited.file_of(_key_of_problem(line, inherited.table))}: {line}"
            for line in error.problems
        ) from None


def _key_of_problem(problem: str, table: merge.Table) -> str:
    """Return the dotted key that a problem is about, "sweep" where a sweep sets it."""
    subject = problem.split(": ")[0]
    key = subject.removeprefix("scene.").split("[")[0].split(" ")[0]
    if not subject.startswith("scene."):
        return key

    sweeps = table.get("sweep", [])
    blocks = sweeps if isinstance(sweeps, list) else [sweeps]
    for block in blocks:
        if isinstance(block, dict) and _sets(axes.swept_keys(block), key):
            return "sweep"
    return key


def _sets(keys: Iterable[str], key: str) -> bool:
    """Whether one of some dotted keys is a key, or lies within or above it."""
    return any(axes.overlap(key, other) for other in keys)


class _Blocks(NamedTuple):
    """What a campaign file says besides scenes; None where it is wrong or missing."""

    axes: tuple[axes.Axis, ...] | None
    differences: cases.Differences | None
    figures: tuple[campaign.FigureSpec, ...] | None
    claims: tuple[claims.ClaimSpec, ...] | None
    readings: tuple[Path, ...] | None
    metadata: dict[str, str] | None
    update: UpdateSpec | None
    report: campaign.ReportSpec | None
    title: str | None
    reference: str | None
    conditions: tuple[str, ...] | None


def _read(inherited: Inherited, file: Path | None) -> campaign.Campaign:
    """Return the campaign of a file merged over what it extends."""
    table = inherited.table
    plugins = _use_plugins(table.get(PLUGINS, []))

    faults = _unknown_keys(table)
    blocks = _read_blocks(table, faults)
    sections = _scene_sections(table, plugins)
    every_case = attempt(
        faults,
        cases.expand,
        sections,
        blocks.axes or (),
        blocks.differences or (),
        load,
    )
    if blocks.update is not None and every_case:
        attempt(faults, update.refuse_unknown_keys, blocks.update, every_case)
    if faults:
        raise CampaignError(faults)

    included, excluded = case.without_excluded(every_case, blocks.conditions or ())
    scene_warnings = dict.fromkeys(
        line for run in included for line in oversights(run.scene)
    )
    return campaign.Campaign(
        title=blocks.title or (file.stem if file else "untitled"),
        reference=blocks.reference or None,
        metadata=blocks.metadata or {},
        cases=included,
        axes=blocks.axes or (),
        figures=blocks.figures or (),
        path=file,
        excluded=excluded,
        plugins=plugins,
        update=blocks.update,
        report=blocks.report or campaign.ReportSpec(),
        warnings=(*values_set_back(inherited.layers), *scene_warnings),
        claims=blocks.claims or (),
        readings=blocks.readings or (),
        written=written_quantities(_tables_of_scenes(sections, blocks)),
    )


def _unknown_keys(table: merge.Table) -> list[str]:
    """Return one line for each key that no campaign file has."""
    valid = list(json_schema.CampaignFile.model_fields)
    remedy = f"; there are {', '.join(valid)}"
    return [
        f"{key}: unknown key{nearest.meant(key, valid, remedy)}"
        for key in table
        if key not in valid
    ]


def _read_blocks(table: merge.Table, faults: list[str]) -> _Blocks:
    """Return what a file says besides scenes; note what is wrong in ``faults``."""
    read = partial(attempt, faults)

    swept = read(axes.read_axes, table.get("sweep", []))
    differences = None
    if swept is not None:
        differences = read(cases.read_differences, table.get("case", []), swept)
    figures = read(blocks_of, campaign.FigureSpec, table.get("figure", []), "figure")
    claimed = read(claims.read_claims, table.get("claim", []))
    metadata = read(_metadata, table.get("metadata", {}))
    measured = None
    if SECTION in table:
        measured = read(update.read_update, table[SECTION])
    report = read(modelled, campaign.ReportSpec, table.get("report", {}), "report")
    if figures is not None and claimed is not None:
        faults += _wrong_notes(figures, claimed)

    return _Blocks(
        axes=swept,
        differences=differences,
        figures=figures,
        claims=claimed,
        readings=read(_two_tables, table.get("readings", [])),
        metadata=metadata,
        update=measured,
        report=report,
        title=read(_text, table, "title"),
        reference=read(_text, table, "reference"),
        conditions=read(case.read_conditions, table.get("exclude", [])),
    )


def _two_tables(value: Any) -> tuple[Path, ...]:
    """Return the paths of the two tables of readings, none where the file names none.

    Raises
    ------
    CampaignError : there are not two
    """
    is_list = isinstance(value, list) and all(isinstance(path, str) for path in value)
    if not is_list or len(value) not in (0, 2):
        raise CampaignError(
            f"readings: {value!r} is no list of two files: what sources print is "
            "entered twice, each time by itself"
        )
    return tuple(Path(path) for path in value)


def _wrong_notes(
    figures: Sequence[campaign.FigureSpec], claimed: Sequence[claims.ClaimSpec]
) -> Iterator[str]:
    """Yield what is wrong with placeholders in notes of figures."""
    for number, figure in enumerate(figures):
        try:
            claims.spelled_note(figure.note or "", claimed)
        except ValueError as error:
            yield f"figure[{number}].note: {error}"


def _scene_sections(table: merge.Table, plugins: Sequence[Plugin]) -> merge.Table:
    """Return the sections that scenes have, and ``expect``, with plug-ins' results."""
    valid = (*Sections.model_fields, cases.EXPECT)
    sections = {key: value for key, value in table.items() if key in valid}
    store = sections.get("store", {})
    results = values_of("results", plugins)
    if isinstance(store, dict) and results:
        stored_results = {**store.get("results", {}), **results}
        sections["store"] = {**store, "results": stored_results}
    return sections


def _use_plugins(names: Any) -> tuple[Plugin, ...]:
    """Make the file's own variants known, before anything of it is read."""
    if not is_list_of(names, str):
        raise CampaignError(
            f"{PLUGINS}: {shown(names)} is no list of Python files or entry points"
        )
    try:
        return use(names)
    except PluginError as error:
        raise CampaignError(f"{PLUGINS}: {error}") from None


def _text(table: merge.Table, key: str) -> str:
    """Return the text under a key, "" where there is none."""
    text = table.get(key, "")
    if not isinstance(text, str):
        raise CampaignError(f"{key}: {shown(text)} is no text")
    return str(text)


def _metadata(table: Any) -> dict[str, str]:
    """Return ``[metadata]``, each list as one text."""
    metadata = modelled(campaign.Metadata, table, "metadata")
    return {
        key: value if isinstance(value, str) else "; ".join(value)
        for key, value in metadata.model_dump(exclude_none=True).items()
    }


def _tables_of_scenes(
    sections: merge.Table, blocks: _Blocks
) -> Iterator[Mapping[str, Any]]:
    """Yield what gives scenes their values: sections, sweeps and cases."""
    yield sections
    for axis in blocks.axes or ():
        yield {key: list(values) for key, values in axis.written.items()}
    for difference in blocks.differences or ():
        yield difference.settings


def written_quantities(
    tables: Iterable[Mapping[str, Any]],
) -> dict[str, tuple[str, ...]]:
    """Return quantities as tables of scenes write them, by dotted key.

    Entries of a list share its key.

    Parameters
    ----------
    tables : sections, or dotted keys and their values

    Examples
    --------
    >>> section = {"operation": {"torque": "0.34 kN*m"}}
    >>> sweep = {"operation.torque": ["340 Nm"]}
    >>> written_quantities([section, sweep])
    {'operation.torque': ('0.34 kN*m', '340 Nm')}
    """
    texts: dict[str, dict[str, None]] = {}
    for table in tables:
        for path, value in flat(dict(table)):
            if not units.is_quantity(value):
                continue
            key = ".".join(word for word in path.split(".") if not word.isdigit())
            texts_of_key = texts.setdefault(key, {})
            if len(texts_of_key) < MAX_QUANTITIES_OF_KEY:
                texts_of_key[value] = None
    return {key: tuple(texts_of_key) for key, texts_of_key in texts.items()}


def values_set_back(layers: Sequence[Layer]) -> Iterator[str]:
    """Yield what files that are extended twice set back, one line each.

    Parameters
    ----------
    layers : the files of a campaign, the one that counts most last
    """
    files = [layer.file for layer in layers]
    tables = [_settings(layer) for layer in layers]
    for last, file in enumerate(files):
        first = files.index(file)
        if first == last:
            continue
        for key, value in tables[last].items():
            if any(_sets(table, key) for table in tables[last + 1 :]):
                continue
            overridden = [
                files[between].name
                for between in range(first, last)
                if files[between] != file
                and _sets_otherwise(tables[between], key, value)
            ]
            if overridden:
                yield (
                    f"extends: {file.name} is reached again after {overridden[-1]} "
                    f"and sets {key} back to {shown(value)}: put {overridden[-1]} last"
                )


def _settings(layer: Layer) -> dict[str, Any]:
    """Return the dotted keys of scenes that one file sets, and their values."""
    sections = {
        name: section
        for name, section in layer.table.items()
        if name not in NOT_OF_SCENES
    }
    return axes.swept_keys(sections)


def _sets_otherwise(table: Mapping[str, Any], key: str, value: Any) -> bool:
    """Whether a table sets a key, or what is within or above, to another value."""
    return any(
        axes.overlap(key, other) and (other, written) != (key, value)
        for other, written in table.items()
    )
