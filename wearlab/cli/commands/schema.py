"""``schema``, ``variables`` and ``new``: what files may say and datasets hold."""

from pathlib import Path
from typing import Annotated, Any

from wearlab.cli import app, options, output
from wearlab.nearest import choices, meant

HEADS = ("name", "dims", "unit", "shown in", "meaning", "made by")
STARTS = Path(__file__).parents[2] / "campaign" / "starts"
SCHEMA = "wearlab-campaign.schema.json"
"""As the files' first line names it; editors with Taplo ("Even Better TOML") read it
there."""


@app.command(
    help="Print the JSON Schema of campaign files: every option with unit, default and "
    "meaning."
)
def schema(
    file: Annotated[
        str | None,
        options.argument("FILE", "A campaign file whose plug-ins are added."),
    ] = None,
    added: Annotated[
        bool,
        options.option(
            "--added", "Only what the file's plug-ins add, by slot and name."
        ),
    ] = False,
    figures: Annotated[
        bool, options.option("--figures", "List the kinds of figures instead.")
    ] = False,
) -> None:
    """Print the JSON Schema of campaign files, or the kinds of figures."""
    if figures:
        from wearlab.figures import KINDS

        return output.show_json(sorted(KINDS))
    from wearlab.campaign import added_json, schema_json

    if added and file is None:
        raise output.Stop("--added needs a campaign FILE that names plug-ins")
    plugins = () if file is None else output.read_plugins(file)
    output.say(added_json(plugins) if added else schema_json())


@app.command(
    help="List the variables of datasets: name, dims, unit, meaning, and what makes "
    "them."
)
def variables(
    like: Annotated[
        str, options.argument("WORD", "Only those with this in name or meaning.")
    ] = "",
) -> output.Findings:
    """List the variables of datasets."""
    from wearlab.schema import VARIABLES, origin_of

    word = like.lower()
    rows: list[dict[str, Any]] = []
    for name, variable in VARIABLES.items():
        if word in f"{name} {variable.long_name} {variable.comment}".lower():
            group, made_by = origin_of(name)
            row = {"name": name} | variable._asdict()
            rows.append(row | {"group": group, "made_by": made_by})
    if not rows:
        nearest = meant(like, VARIABLES).replace(",", ";", 1)
        raise output.Stop(
            f"variables: none has {like!r} in its name or meaning{nearest}"
        )
    table = output.ShownTable(HEADS, [_variable_cells(row) for row in rows])
    return output.Findings(rows, [table])


def _variable_cells(row: dict[str, Any]) -> list[str]:
    """Return a variable of datasets as a table shows it."""
    meaning = row["long_name"]
    if row["comment"]:
        meaning += f" ({row['comment']})"
    return [
        row["name"],
        ", ".join(row["dims"]),
        row["units"],
        row["display_units"],
        meaning,
        row["made_by"],
    ]


@app.command(
    help="Write a commented campaign file to begin with, and the JSON Schema that "
    "editors complete it by."
)
def new(
    kind: Annotated[
        str,
        options.argument(
            "KIND", "external-pair, internal-pair, planetary, fzg or wind-stage."
        ),
    ],
    out: Annotated[
        Path | None,
        options.option(
            "--out", "The file to write.", "FILE", show_default="KIND, .toml"
        ),
    ] = None,
) -> None:
    """Write a campaign file to begin with."""
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
    """Return the kinds of gear sets that a first file exists for."""
    return sorted(path.stem for path in STARTS.glob("*.toml"))
