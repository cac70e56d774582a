"""Whatever describes runs becomes a campaign: a file, a table, a scene or a list of scenes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from wearlab import nearest, units
from wearlab.campaign import (
    axes,
    campaign,
    case,
    cases,
    claims,
    inheritance,
    json_schema,
    update,
)
from wearlab.campaign.update_options import SECTION
from wearlab.plugins import Plugin, PluginError, held, use
from wearlab.query.keys import flat, scene_key
from wearlab.scene import Scene, merge, oversights, problems

TOLD_ELSEWHERE = (
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


def undone(layers: Sequence[inheritance.Layer]) -> Iterator[str]:
    """Yield what files that are extended twice set back, one line each.

    Parameters
    ----------
    layers : the files of a campaign, the one that counts most last
    """
    files = [layer.file for layer in layers]
    written = [
        axes.swept_keys(
            {
                name: own
                for name, own in layer.table.items()
                if name not in TOLD_ELSEWHERE
            }
        )
        for layer in layers
    ]
    for again, file in enumerate(files):
        first = files.index(file)
        for key, value in written[again].items() if first < again else ():
            others = (
                range(first, again)
                if not any(_sets(own, key) for own in written[again + 1 :])
                else ()
            )
            between = [
                files[n].name
                for n in others
                if files[n] != file and _sets(written[n], key, value)
            ]
            if between:
                said = (
                    f"is reached again after {between[-1]} and sets {key} back to "
                    f"{problems.shown(value)}"
                )
                yield f"extends: {file.name} {said}: put {between[-1]} last"


def _sets(table: Mapping[str, Any], key: str, but: Any = None) -> bool:
    """Return whether a table of dotted keys sets a key, or what lies within or above, to another value."""
    return any(
        axes.overlap(key, own) and (own, x) != (key, but) for own, x in table.items()
    )


TABLE = Path("campaign")  # what errors call a campaign that is no file


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
        inherited = inheritance.over_parents(inheritance.plain(path), TABLE, Path.cwd())
    else:
        file = Path(path).expanduser().resolve()
        inherited = inheritance.inherit(file)
    with _naming_files(inherited):
        return _read(inherited, file)


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
    inherited = inheritance.inherit(Path(path).expanduser().resolve())
    with _naming_files(inherited):
        return _plugins(inherited.table.get(inheritance.PLUGINS, []))


@contextmanager
def _naming_files(inherited: inheritance.Inherited) -> Iterator[None]:
    """Put in front of every problem the file that wrote what it is about."""
    try:
        yield
    except inheritance.CampaignError as error:
        raise inheritance.CampaignError(
            f"{inherited.file_of(_written_at(line, inherited.table))}: {line}"
            for line in error.problems
        ) from None


def _written_at(problem: str, table: merge.Table) -> str:
    """Return the dotted key that a problem is about.

    "sweep" where that gives the value.
    """
    about = problem.split(": ")[0]
    path = about.removeprefix("scene.").split("[")[0].split(" ")[0]
    blocks = table.get("sweep", [])
    for block in blocks if isinstance(blocks, list) else [blocks]:
        if about.startswith("scene.") and isinstance(block, dict):
            if any(axes.overlap(path, key) for key in axes.swept_keys(block)):
                return "sweep"
    return path


def _read(inherited: inheritance.Inherited, file: Path | None) -> campaign.Campaign:
    table = inherited.table
    plugins = _plugins(table.get(inheritance.PLUGINS, []))
    valid = list(json_schema.CampaignFile.model_fields)
    listed = f"; there are {', '.join(valid)}"
    faults = [
        f"{key}: unknown key{nearest.meant(key, valid, listed)}"
        for key in table
        if key not in valid
    ]
    tried = partial(inheritance.tried, faults)
    swept = tried(axes.read_axes, table.get("sweep", []))
    differences = (
        None
        if swept is None
        else tried(cases.read_differences, table.get("case", []), swept)
    )
    told: dict[str, Any] = {
        "figures": tried(
            inheritance.blocks_of,
            campaign.FigureSpec,
            table.get("figure", []),
            "figure",
        ),
        "claims": tried(claims.read_claims, table.get("claim", [])),
        "metadata": tried(_metadata, table.get("metadata", {})),
        "update": tried(update.read_update, table[SECTION])
        if SECTION in table
        else None,
        "report": tried(
            inheritance.modelled, campaign.ReportSpec, table.get("report", {}), "report"
        ),
    }
    for number, figure in enumerate(
        told["figures"] or () if told["claims"] is not None else ()
    ):
        try:
            claims.spelled_note(figure.note or "", told["claims"])
        except ValueError as error:
            faults.append(f"figure[{number}].note: {error}")
    title = tried(_text, table, "title")
    reference = tried(_text, table, "reference")
    sections = {
        key: value
        for key, value in table.items()
        if key in (*Scene.model_fields, cases.EXPECT)
    }
    kept = sections.get("store", {})
    if isinstance(kept, dict) and (own := held("results", plugins)):
        sections["store"] = {**kept, "results": {**kept.get("results", {}), **own}}
    conditions = tried(case.read_conditions, table.get("exclude", []))
    every = tried(cases.expand, sections, swept or (), differences or (), load)
    if told["update"] is not None and every:
        tried(update.refuse_unknown_keys, told["update"], every)
    if faults:
        raise inheritance.CampaignError(faults)
    told["cases"], told["excluded"] = case.without_excluded(every, conditions)
    unmeant = dict.fromkeys(
        line for one in told["cases"] for line in oversights(one.scene)
    )
    tables = [
        sections,
        *({key: list(texts) for key, texts in axis.written.items()} for axis in swept),
    ]
    return campaign.Campaign(
        title=title or (file.stem if file else "untitled"),
        reference=reference or None,
        axes=swept,
        path=file,
        plugins=plugins,
        warnings=(*undone(inherited.layers), *unmeant),
        written=written_quantities(
            [*tables, *(difference.settings for difference in differences or ())]
        ),
        **told,
    )


MOST_WRITTEN = 100  # quantities of a key


def written_quantities(
    tables: Iterable[Mapping[str, Any]],
) -> dict[str, tuple[str, ...]]:
    """Return quantities as tables of scenes write them, by dotted key.

    Entries of a list share its key.

    Examples
    --------
    >>> written_quantities([{"operation": {"torque": "0.34 kN*m"}}, {"operation.torque": ["340 Nm"]}])
    {'operation.torque': ('0.34 kN*m', '340 Nm')}
    """
    found: dict[str, dict[str, None]] = {}
    for table in tables:
        for path, value in flat(dict(table)):
            key = ".".join(word for word in path.split(".") if not word.isdigit())
            if (
                units.is_quantity(value)
                and len(known := found.setdefault(key, {})) < MOST_WRITTEN
            ):
                known[value] = None
    return {key: tuple(texts) for key, texts in found.items()}


def _plugins(named: Any) -> tuple[Plugin, ...]:
    """Make the file's own variants known, before anything of it is read."""
    if not inheritance.is_list_of(named, str):
        raise inheritance.CampaignError(
            f"{inheritance.PLUGINS}: {problems.shown(named)} is no list of Python "
            "files or entry points"
        )
    try:
        return use(named)
    except PluginError as error:
        raise inheritance.CampaignError(f"{inheritance.PLUGINS}: {error}") from None


def _text(table: merge.Table, key: str) -> str:
    if not isinstance(table.get(key, ""), str):
        raise inheritance.CampaignError(
            f"{key}: {problems.shown(table[key])} is no text"
        )
    return str(table.get(key, ""))


def _metadata(given: Any) -> dict[str, str]:
    told = inheritance.modelled(campaign.Metadata, given, "metadata").model_dump(
        exclude_none=True
    )
    return {
        key: value if isinstance(value, str) else "; ".join(value)
        for key, value in told.items()
    }


Given = (
    campaign.Campaign
    | Scene
    | Sequence[Scene]
    | Mapping[str, Any]
    | str
    | PathLike[str]
)
ALONG = "scene"


def campaign_of(given: Given) -> campaign.Campaign:
    """Return the campaign that is meant.

    Parameters
    ----------
    given : a campaign; the path of its file; a mapping like a file; a scene; a list of
        scenes, which become an axis ``scene`` with everything in which they differ
        along it

    Raises
    ------
    CampaignError : the file or the mapping is wrong
    TypeError : it is none of these
    """
    match given:
        case Scene():
            return campaign.Campaign(
                "one scene", None, {}, (case.Case(case.BASE, given, {}),)
            )
        case Mapping() | str() | PathLike():
            return load(given)  # type: ignore[arg-type]
        case Sequence():
            scenes = [block for block in given if isinstance(block, Scene)]
            if not scenes or len(scenes) < len(given):
                raise TypeError("a list of runs holds scenes only, and at least one")
            numbered = tuple(
                case.Case(case.BASE, scene, {ALONG: n})
                for n, scene in enumerate(scenes)
            )
            axis = axes.Axis(
                ALONG, tuple(range(len(scenes))), coordinates=_differences(scenes)
            )
            return campaign.Campaign(
                f"{len(scenes)} scenes", None, {}, numbered, (axis,)
            )
        case _ if hasattr(given, "cases"):  # also a record of one
            return given
    raise TypeError(
        f"{type(given).__name__} is no campaign: give one, its file, a mapping, or "
        "scenes"
    )


def _differences(scenes: Sequence[Scene]) -> dict[str, axes.Coordinate]:
    """Return what differs between scenes, by as few last words of its key as make a free name."""
    tables = [dict(flat(scene.model_dump())) for scene in scenes]
    differences: dict[str, axes.Coordinate] = {}
    for key in tables[0]:
        values = tuple(table.get(key) for table in tables)
        plain = all(isinstance(value, str | int | float) for value in values)
        if (
            plain
            and len(set(values)) > 1
            and (name := axes.free_name(key, {*differences, *axes.RESERVED}))
        ):
            differences[name] = _shown(values, key)
    return differences


def _shown(values: tuple[Any, ...], key: str) -> axes.Coordinate:
    """Return values in the unit in which people write them."""
    known = scene_key(key, isinstance(values[0], str))
    if not known.unit or known.unit == known.display_unit:
        return axes.Coordinate(values, known.unit or None, key)
    shown = tuple(
        units.convert(float(value), known.unit, known.display_unit) for value in values
    )
    return axes.Coordinate(shown, known.display_unit, key)
