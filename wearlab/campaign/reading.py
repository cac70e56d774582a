"""A campaign: one file, its scenes, its figures."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from wearlab.campaign.axes import flat, overlap, read_axes
from wearlab.campaign.campaign import Campaign, Metadata
from wearlab.campaign.cases import EXPECT, expand, read_differences
from wearlab.campaign.errors import CampaignError
from wearlab.campaign.exclusion import read_conditions, without_excluded
from wearlab.campaign.figure import FigureSpec
from wearlab.campaign.inheritance import PLUGINS, Inherited, inherit, inherit_table
from wearlab.campaign.measured import SECTION as UPDATE
from wearlab.campaign.modelled import modelled
from wearlab.campaign.plain import is_list_of, plain_table
from wearlab.campaign.report import SECTION as REPORT
from wearlab.campaign.report import read_report
from wearlab.campaign.undone import undone
from wearlab.campaign.update import read_update, refuse_strange_unknowns
from wearlab.nearest import meant
from wearlab.plugins import Plugin, PluginError, use
from wearlab.scene import Scene, oversights
from wearlab.scene.later import LATER_KEYS, later
from wearlab.scene.merge import Table
from wearlab.scene.problems import shown

OWN_KEYS = (
    "title",
    "reference",
    "extends",
    "drop",
    "metadata",
    PLUGINS,
    "sweep",
    "case",
    "exclude",
    "figure",
    "expect",
    "update",
    "report",
)
Result = TypeVar("Result")
At = TypeVar("At", bound=Path | None)
TABLE = Path("campaign")  # what errors call a campaign that is no file


def load(path: str | Path | Mapping[str, Any]) -> Campaign:
    """Read a campaign file, with all that it extends, or a table that says the same.

    Parameters
    ----------
    path : a TOML file; or a mapping of its keys, whose paths start from the current folder

    Returns
    -------
    Campaign

    Raises
    ------
    CampaignError
        When anything in it is wrong; every fault is one line with file, path, value and remedy.
    """
    if isinstance(path, Mapping):
        file, inherited = None, inherit_table(plain_table(path), TABLE, Path.cwd())
    else:
        file = Path(path).expanduser().resolve()
        inherited = inherit(file)
    return _told_with_file(inherited, file, _read)


def read_plugins(path: str | Path) -> tuple[Plugin, ...]:
    """Make the variants known that a file, or one that it extends, brings by its plug-ins; read nothing else.

    Parameters
    ----------
    path : a TOML file

    Raises
    ------
    CampaignError
        When it cannot be read, or a plug-in may not be run and nothing is known of it.
    """
    file = Path(path).expanduser().resolve()
    return _told_with_file(
        inherit(file), file, lambda inherited, _: _plugins(inherited.table.get(PLUGINS, []))
    )


def _told_with_file(inherited: Inherited, file: At, read: Callable[[Inherited, At], Result]) -> Result:
    try:
        return read(inherited, file)
    except CampaignError as error:
        raise CampaignError(_with_file(line, inherited) for line in error.problems) from None


def _with_file(line: str, inherited: Inherited) -> str:
    """Return a problem with the file in front that wrote what it is about."""
    about = line.split(": ")[0]
    path = about.removeprefix("scene.").split("[")[0].split(" ")[0]
    if about.startswith("scene.") and any(overlap(path, key) for key in _swept_keys(inherited.table)):
        path = "sweep"
    return f"{inherited.file_of(path)}: {line}"


def _swept_keys(table: Table) -> list[str]:
    blocks = table.get("sweep", [])
    blocks = blocks if isinstance(blocks, list) else [blocks]
    return [key for block in blocks if isinstance(block, dict) for key in flat(block)]


def _read(inherited: Inherited, file: Path | None) -> Campaign:
    table = inherited.table
    plugins = _plugins(table.get(PLUGINS, []))
    problems = list(_unknown(table))
    tried: Callable[..., Any] = lambda read, *args: _tried(problems, read, *args)  # noqa: E731
    axes = tried(read_axes, table.get("sweep", []))
    differences = None if axes is None else tried(read_differences, table.get("case", []), axes)
    figures = tried(_figures, table.get("figure", []))
    metadata = tried(_metadata, table.get("metadata", {}))
    texts = [tried(_text, table, key) for key in ("title", "reference")]
    sections = {key: value for key, value in table.items() if key in (*Scene.model_fields, EXPECT)}
    conditions = tried(read_conditions, table.get("exclude", []))
    cases = tried(expand, sections, axes or (), differences or (), load)
    update = tried(read_update, table[UPDATE]) if UPDATE in table else None
    report = tried(read_report, table.get(REPORT, {}))
    if update is not None and cases:
        tried(refuse_strange_unknowns, update, [case.scene for case in cases], [c.label for c in cases])
    if problems:
        raise CampaignError(problems)
    cases, excluded = without_excluded(cases, conditions)
    title, reference = texts[0] or (file.stem if file else "untitled"), texts[1] or None
    unmeant = dict.fromkeys(line for case in cases for line in oversights(case.scene))
    warnings = (*undone(inherited.layers), *unmeant)
    return Campaign(
        title, reference, metadata, cases, axes, figures, file, excluded, plugins, update, report, warnings
    )


def _plugins(named: Any) -> tuple[Plugin, ...]:
    """Make the file's own variants known, before anything of it is read."""
    if not is_list_of(named, str):
        raise CampaignError([f"{PLUGINS}: {shown(named)} is no list of Python files or entry points"])
    try:
        return use(named)
    except PluginError as error:
        raise CampaignError([f"{PLUGINS}: {error}"]) from None


def _tried(problems: list[str], read: Callable[..., Result], *arguments: Any) -> Result | None:
    """Return what a reader returns; its problems join the others."""
    try:
        return read(*arguments)
    except CampaignError as error:
        problems.extend(error.problems)
        return None


def _unknown(table: Table) -> list[str]:
    valid = [*OWN_KEYS, *Scene.model_fields]
    problems = []
    for key in table:
        if key in LATER_KEYS[""]:
            problems.append(f"{key}: {later(LATER_KEYS[''][key])}")
        elif key not in valid:
            remedy = meant(key, valid, f"; there are {', '.join(valid)}")
            problems.append(f"{key}: unknown key{remedy}")
    return problems


def _text(table: Table, key: str) -> str:
    if not isinstance(table.get(key, ""), str):
        raise CampaignError([f"{key}: {shown(table[key])} is no text"])
    return str(table.get(key, ""))


def _metadata(given: Any) -> dict[str, str]:
    told = modelled(Metadata, given, "metadata").model_dump(exclude_none=True)
    return {key: value if isinstance(value, str) else "; ".join(value) for key, value in told.items()}


def _figures(blocks: Any) -> tuple[FigureSpec, ...]:
    if not isinstance(blocks, list):
        raise CampaignError([f"figure: {shown(blocks)} is no list of tables: write [[figure]]"])
    return tuple(modelled(FigureSpec, block, f"figure[{number}]") for number, block in enumerate(blocks))
