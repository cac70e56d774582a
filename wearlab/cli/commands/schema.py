"""``schema``, ``variables`` and ``new``: what files may say, what datasets hold, and files to begin with."""

from pathlib import Path
from typing import Any

from wearlab.cli import app, output
from wearlab.nearest import choices, meant


@app.command()
def schema(file: str | None = None, added: bool = False, figures: bool = False) -> None:
    """Print the JSON Schema of campaign files: every option with unit, default and meaning.

    Parameters
    ----------
    file : [FILE]: A campaign file whose plug-ins are added.
    added : Only what the file's plug-ins add, by slot and name.
    figures : List the kinds of figures instead.
    """
    if figures:
        from wearlab.figures import KINDS

        return output.show_json(sorted(KINDS))
    from wearlab.campaign import added_json, schema_json

    if added and file is None:
        raise output.Stop("--added needs a campaign FILE that names plug-ins")
    plugins = () if file is None else output.read_plugins(file)
    output.say(added_json(plugins) if added else schema_json())


HEADS = ("name", "dims", "unit", "shown in", "meaning", "made by")


@app.command()
def variables(like: str = "") -> output.Findings:
    """List the variables of datasets: name, dims, unit, meaning, and what makes them.

    Parameters
    ----------
    like : [WORD]: Only those with this in name or meaning.
    """
    from wearlab.schema import VARIABLES, origin_of

    word = like.lower()
    rows: list[dict[str, Any]] = [
        {"name": name}
        | variable._asdict()
        | dict(zip(("group", "made_by"), origin_of(name), strict=True))
        for name, variable in VARIABLES.items()
        if word in f"{name} {variable.long_name} {variable.comment}".lower()
    ]
    if not rows:
        near = meant(like, VARIABLES).replace(",", ";", 1)
        raise output.Stop(f"variables: none has {like!r} in its name or meaning{near}")
    return output.Findings(rows, [output.ShownTable(HEADS, [*map(_cells, rows)])])


def _cells(row: dict[str, Any]) -> list[str]:
    meaning = (
        f"{row['long_name']} ({row['comment']})" if row["comment"] else row["long_name"]
    )
    told = row | {"dims": ", ".join(row["dims"]), "meaning": meaning}
    return [
        told[key]
        for key in ("name", "dims", "units", "display_units", "meaning", "made_by")
    ]


STARTS = Path(__file__).parents[2] / "campaign" / "starts"
SCHEMA = "wearlab-campaign.schema.json"
"""As the files' first line names it; editors with Taplo ("Even Better TOML") read it
there."""


@app.command()
def new(kind: str, out: Path | None = None) -> None:
    """Write a commented campaign file to begin with, and the JSON Schema that editors complete it by.

    Parameters
    ----------
    kind : KIND: external-pair, internal-pair, planetary, fzg or wind-stage.
    out : FILE [KIND, .toml]: The file to write.
    """
    from wearlab.campaign import editors_schema
    from wearlab.store.files import write_whole

    if kind not in kinds():
        raise output.Stop(f"new {kind}: {choices(kind, kinds())}")
    path = out or Path(f"{kind}.toml")
    if path.exists():
        raise output.Stop(f"{path}: is there already; name another with --out")
    text = (
        (STARTS / f"{kind}.toml")
        .read_text(encoding="utf-8")
        .replace("{file}", path.name)
    )
    with output.refusing(OSError):
        write_whole(path.parent / SCHEMA, f"{editors_schema()}\n".encode())
        write_whole(path, text.encode())
    output.say(
        f"{path}: now edit it, then: wearlab check {path}, wearlab run {path}, "
        f"wearlab report {path}"
    )


def kinds() -> list[str]:
    """Return the kinds of gear sets that there is a file to begin with for."""
    return sorted(path.stem for path in STARTS.glob("*.toml"))
