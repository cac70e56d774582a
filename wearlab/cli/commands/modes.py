"""Natural frequencies and critical speeds."""

from typing import Annotated, Any

import typer

from wearlab.cli.options import File, Json
from wearlab.cli.output import Status, Stop, read_campaign, refusing, show_json, show_table
from wearlab.cli.registry import app
from wearlab.cli.sound import first_of_each_label


@app.command()
def modes(
    file: File,
    case: Annotated[
        str | None, typer.Option(metavar="LABEL", help="Which case.", show_default="the first")
    ] = None,
    json: Json = False,
) -> Status:
    """Show natural frequencies and critical speeds of FILE's gears."""
    campaign = read_campaign(file)
    cases = first_of_each_label(campaign)
    if case is None:
        case = campaign.cases[0].label
    if case not in cases:
        raise Stop(f"--case {case}: there are {', '.join(cases)}")
    from wearlab.gears.specification import GearError
    from wearlab.simulation import modes_table

    with refusing(GearError, ValueError):
        rows: list[dict[str, Any]] = modes_table(cases[case].scene)
    if json:
        show_json(rows)
    elif rows:
        show_table(list(rows[0]), [[_cell(value) for value in row.values()] for row in rows])
    return Status.WELL


def _cell(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
