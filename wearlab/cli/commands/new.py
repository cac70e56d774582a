"""A campaign file to begin with: commented, wired to the JSON Schema for editors."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.output import Status, Stop, refusing, say
from wearlab.cli.registry import app
from wearlab.figures.errors import choices

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
