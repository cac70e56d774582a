"""Whatever describes runs becomes a campaign: a file, a table, a scene or a list of scenes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

from wearlab import nearest, units
from wearlab.campaign import campaign, case, inheritance, update_options
from wearlab.campaign.axes import RESERVED, Axis, Coordinate, overlap, read_axes, swept_keys
from wearlab.campaign.cases import EXPECT, expand, read_differences
from wearlab.campaign.claims import note_problems, read_claims
from wearlab.campaign.json_schema import CampaignFile
from wearlab.campaign.update import read_update, refuse_unknown_keys
from wearlab.plugins import Plugin, PluginError, held, use
from wearlab.query.keys import flat, scene_key
from wearlab.scene import Scene, merge, oversights
from wearlab.scene.problems import shown

TOLD_ELSEWHERE = ("title", "reference", "figure", "claim", "sweep", "case", "metadata", "report", "exclude")


def undone(layers: Sequence[inheritance.Layer]) -> Iterator[str]:
    """Yield what files that are extended twice set back, one line each.

    Parameters
    ----------
    layers : the files of a campaign, the one that counts most last
    """
    for again, layer in enumerate(layers):
        first = next(i for i, other in enumerate(layers) if other.file == layer.file)
        if first == again:
            continue
        for key, value in _values(layer):
            others = [other for other in layers[first + 1 : again] if other.file != layer.file]
            between = [other for other in others if _sets_otherwise(other, key, value)]
            later = any(overlap(key, other) for layer in layers[again + 1 :] for other, _ in _values(layer))
            if between and not later:
                other = between[-1].file.name
                yield (
                    f"extends: {layer.file.name} is reached again after {other} and sets {key} "
                    f"back to {shown(value)}: put {other} last"
                )


def _values(layer: inheritance.Layer) -> list[tuple[str, object]]:
    sections = {name: own for name, own in layer.table.items() if name not in TOLD_ELSEWHERE}
    return list(swept_keys(sections).items())


def _sets_otherwise(layer: inheritance.Layer, key: str, value: object) -> bool:
    return any(overlap(key, other) and (other, own) != (key, value) for other, own in _values(layer))


Result = TypeVar("Result")
At = TypeVar("At", bound=Path | None)
TABLE = Path("campaign")  # what errors call a campaign that is no file


def load(path: str | Path | Mapping[str, Any]) -> campaign.Campaign:
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
        file, inherited = None, inheritance.inherit_table(inheritance.plain_table(path), TABLE, Path.cwd())
    else:
        file = Path(path).expanduser().resolve()
        inherited = inheritance.inherit(file)
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
        inheritance.inherit(file),
        file,
        lambda inherited, _: _plugins(inherited.table.get(inheritance.PLUGINS, [])),
    )


def _told_with_file(
    inherited: inheritance.Inherited, file: At, read: Callable[[inheritance.Inherited, At], Result]
) -> Result:
    try:
        return read(inherited, file)
    except inheritance.CampaignError as error:
        raise inheritance.CampaignError(_with_file(line, inherited) for line in error.problems) from None


def _with_file(line: str, inherited: inheritance.Inherited) -> str:
    """Return a problem with the file in front that wrote what it is about."""
    about = line.split(": ")[0]
    path = about.removeprefix("scene.").split("[")[0].split(" ")[0]
    if about.startswith("scene.") and any(overlap(path, key) for key in _swept_keys(inherited.table)):
        path = "sweep"
    return f"{inherited.file_of(path)}: {line}"


def _swept_keys(table: merge.Table) -> list[str]:
    blocks = table.get("sweep", [])
    blocks = blocks if isinstance(blocks, list) else [blocks]
    return [key for block in blocks if isinstance(block, dict) for key in swept_keys(block)]


def _read(inherited: inheritance.Inherited, file: Path | None) -> campaign.Campaign:
    table = inherited.table
    plugins = _plugins(table.get(inheritance.PLUGINS, []))
    problems = list(_unknown(table))
    tried: Callable[..., Any] = lambda read, *args: _tried(problems, read, *args)  # noqa: E731
    axes = tried(read_axes, table.get("sweep", []))
    differences = None if axes is None else tried(read_differences, table.get("case", []), axes)
    figures = tried(_figures, table.get("figure", []))
    claims = tried(read_claims, table.get("claim", []))
    if figures and claims is not None:
        problems += note_problems([figure.note for figure in figures], claims)
    metadata = tried(_metadata, table.get("metadata", {}))
    texts = [tried(_text, table, key) for key in ("title", "reference")]
    sections = {key: value for key, value in table.items() if key in (*Scene.model_fields, EXPECT)}
    sections = _with_results(sections, plugins)
    conditions = tried(case.read_conditions, table.get("exclude", []))
    cases = tried(expand, sections, axes or (), differences or (), load)
    update = tried(read_update, table[update_options.SECTION]) if update_options.SECTION in table else None
    report = tried(campaign.read_report, table.get(campaign.SECTION, {}))
    if update is not None and cases:
        tried(refuse_unknown_keys, update, [case.scene for case in cases], [c.label for c in cases])
    if problems:
        raise inheritance.CampaignError(problems)
    cases, excluded = case.without_excluded(cases, conditions)
    title, reference = texts[0] or (file.stem if file else "untitled"), texts[1] or None
    unmeant = dict.fromkeys(line for case in cases for line in oversights(case.scene))
    warnings = (*undone(inherited.layers), *unmeant)
    tables = [sections, *({key: list(texts) for key, texts in axis.written.items()} for axis in axes or ())]
    written = campaign.written_quantities([*tables, *(each.own for each in differences or ())])
    return campaign.Campaign(
        title,
        reference,
        metadata,
        cases,
        axes,
        figures,
        file,
        excluded,
        plugins,
        update,
        report,
        warnings,
        claims,
        written,
    )


def _plugins(named: Any) -> tuple[Plugin, ...]:
    """Make the file's own variants known, before anything of it is read."""
    if not inheritance.is_list_of(named, str):
        raise inheritance.CampaignError(
            f"{inheritance.PLUGINS}: {shown(named)} is no list of Python files or entry points"
        )
    try:
        return use(named)
    except PluginError as error:
        raise inheritance.CampaignError(f"{inheritance.PLUGINS}: {error}") from None


def _with_results(sections: merge.Table, plugins: tuple[Plugin, ...]) -> merge.Table:
    """Return sections that have the results of plug-ins stored."""
    own, kept = held("results", plugins), sections.get("store", {})
    if not own or not isinstance(kept, dict):
        return sections
    return {**sections, "store": {**kept, "results": {**kept.get("results", {}), **own}}}


def _tried(problems: list[str], read: Callable[..., Result], *arguments: Any) -> Result | None:
    """Return what a reader returns; its problems join the others."""
    try:
        return read(*arguments)
    except inheritance.CampaignError as error:
        problems.extend(error.problems)
        return None


def _unknown(table: merge.Table) -> list[str]:
    valid = list(CampaignFile.model_fields)
    problems = []
    for key in table:
        if key not in valid:
            remedy = nearest.meant(key, valid, f"; there are {', '.join(valid)}")
            problems.append(f"{key}: unknown key{remedy}")
    return problems


def _text(table: merge.Table, key: str) -> str:
    if not isinstance(table.get(key, ""), str):
        raise inheritance.CampaignError(f"{key}: {shown(table[key])} is no text")
    return str(table.get(key, ""))


def _metadata(given: Any) -> dict[str, str]:
    told = inheritance.modelled(campaign.Metadata, given, "metadata").model_dump(exclude_none=True)
    return {key: value if isinstance(value, str) else "; ".join(value) for key, value in told.items()}


def _figures(blocks: Any) -> tuple[campaign.FigureSpec, ...]:
    if not isinstance(blocks, list):
        raise inheritance.CampaignError(f"figure: {shown(blocks)} is no list of tables: write [[figure]]")
    return tuple(
        inheritance.modelled(campaign.FigureSpec, block, f"figure[{number}]")
        for number, block in enumerate(blocks)
    )


Given = campaign.Campaign | Scene | Sequence[Scene] | Mapping[str, Any] | str | PathLike[str]
ALONG = "scene"


def campaign_of(given: Given) -> campaign.Campaign:
    """Return the campaign that is meant.

    Parameters
    ----------
    given : a campaign; the path of its file; a mapping like a file; a scene; a list of scenes, which become
        an axis ``scene`` with everything in which they differ along it

    Raises
    ------
    CampaignError : the file or the mapping is wrong
    TypeError : it is none of these
    """
    match given:
        case Scene():
            return campaign.Campaign("one scene", None, {}, (case.Case(case.BASE, given, {}),))
        case Mapping() | str() | PathLike():
            return load(given)  # type: ignore[arg-type]
        case Sequence():
            scenes = [block for block in given if isinstance(block, Scene)]
            if not scenes or len(scenes) < len(given):
                raise TypeError("a list of runs holds scenes only, and at least one")
            return _of_scenes(scenes)
        case _ if hasattr(given, "cases"):  # also a record of one
            return given
    raise TypeError(f"{type(given).__name__} is no campaign: give one, its file, a mapping, or scenes")


def _of_scenes(scenes: Sequence[Scene]) -> campaign.Campaign:
    cases = tuple(case.Case(case.BASE, scene, {ALONG: number}) for number, scene in enumerate(scenes))
    axis = Axis(ALONG, tuple(range(len(scenes))), coordinates=_differences(scenes))
    return campaign.Campaign(f"{len(scenes)} scenes", None, {}, cases, (axis,))


def _differences(scenes: Sequence[Scene]) -> dict[str, Coordinate]:
    """Return what differs between scenes, by as few last words of its key as make a free name."""
    tables = [dict(flat(scene.model_dump())) for scene in scenes]
    keys = [
        key
        for key in tables[0]
        if all(isinstance(given_table.get(key), str | int | float) for given_table in tables)
    ]
    differences: dict[str, Coordinate] = {}
    for key in keys:
        values = tuple(table[key] for table in tables)
        if len(set(values)) > 1:
            words = key.split(".")
            names = ("_".join(words[-count:]) for count in range(1, len(words) + 1))
            name = next(
                (
                    known_name
                    for known_name in names
                    if known_name not in differences and known_name not in RESERVED
                ),
                None,
            )
            if name is not None:
                differences[name] = _shown(values, key)
    return differences


def _shown(values: tuple[Any, ...], key: str) -> Coordinate:
    """Return values in the unit in which people write them."""
    known = scene_key(key, isinstance(values[0], str))
    if not known.unit or known.unit == known.display_unit:
        return Coordinate(values, known.unit or None, key)
    shown = tuple(units.convert(float(value), known.unit, known.display_unit) for value in values)
    return Coordinate(shown, known.display_unit, key)
