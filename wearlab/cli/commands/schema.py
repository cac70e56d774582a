"""``schema``, ``variables`` and ``new``: what files may say, what datasets hold, and files to begin with."""

from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.output import Status, Stop, read_plugins, refusing, say, show_json, show_table
from wearlab.cli.registry import Json, app
from wearlab.figures.errors import choices


@app.command()
def schema(
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="[FILE]", help="A campaign file whose plug-ins are added.", show_default=False
        ),
    ] = None,
    added: Annotated[
        bool, typer.Option("--added", help="Only what the file's plug-ins add, by slot and name.")
    ] = False,
    figures: Annotated[bool, typer.Option("--figures", help="List the kinds of figures instead.")] = False,
) -> Status:
    """Print the JSON Schema of campaign files: every option with unit, default and meaning."""
    if figures:
        from wearlab.figures import KINDS

        show_json(sorted(KINDS))
        return Status.WELL
    from wearlab.campaign import added_json, schema_json

    if added and file is None:
        raise Stop("--added needs a campaign FILE that names plug-ins")
    plugins = () if file is None else read_plugins(file)
    say(added_json(plugins) if added else schema_json())
    return Status.WELL


HEADS = ("name", "dims", "unit", "shown in", "meaning", "made by")


@app.command()
def variables(
    like: Annotated[
        str, typer.Argument(metavar="[WORD]", help="Only those with this in name or meaning.")
    ] = "",
    json: Json = False,
) -> Status:
    """List the variables of datasets: name, dims, unit, meaning, and what makes them."""
    from wearlab.schema import VARIABLES, origin_of

    word = like.lower()
    known = {
        name: variable
        for name, variable in VARIABLES.items()
        if word in f"{name} {variable.long_name} {variable.comment}".lower()
    }
    if not known:
        near = get_close_matches(like, VARIABLES, 1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        raise Stop(f"variables: none has {like!r} in its name or meaning{meant}")
    if json:
        show_json(
            [
                {
                    "name": name,
                    "dims": list(variable.dims),
                    "units": variable.units,
                    "display_units": variable.display_units,
                    "long_name": variable.long_name,
                    "comment": variable.comment,
                    "group": origin_of(name)[0],
                    "made_by": origin_of(name)[1],
                }
                for name, variable in known.items()
            ]
        )
        return Status.WELL
    rows = []
    for name, variable in known.items():
        meaning = f"{variable.long_name} ({variable.comment})" if variable.comment else variable.long_name
        rows.append(
            (
                name,
                ", ".join(variable.dims),
                variable.units,
                variable.display_units,
                meaning,
                origin_of(name)[1],
            )
        )
    show_table(HEADS, rows)
    return Status.WELL


STARTS = Path(__file__).parents[2] / "campaign" / "starts"
SCHEMA = "wearlab-campaign.schema.json"
"""As the files' first line names it; editors with Taplo ("Even Better TOML") read it there."""


@app.command()
def new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="external-pair, internal-pair, planetary, fzg or wind-stage.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The file to write.", show_default="KIND, .toml"),
    ] = None,
) -> Status:
    """Write a commented campaign file to begin with, and the JSON Schema that editors complete it by."""
    from wearlab.campaign import editors_schema
    from wearlab.store.files import write_whole

    if kind not in kinds():
        raise Stop(f"new {kind}: {choices(kind, kinds())}")
    path = out or Path(f"{kind}.toml")
    if path.exists():
        raise Stop(f"{path}: is there already; name another with --out")
    text = (STARTS / f"{kind}.toml").read_text(encoding="utf-8").replace("{file}", path.name)
    with refusing(OSError):
        write_whole(path.parent / SCHEMA, f"{editors_schema()}\n".encode())
        write_whole(path, text.encode())
    say(f"{path}: now edit it, then: wearlab check {path}, wearlab run {path}, wearlab report {path}")
    return Status.WELL


def kinds() -> list[str]:
    """Return the kinds of gear sets that there is a file to begin with for."""
    return sorted(path.stem for path in STARTS.glob("*.toml"))
