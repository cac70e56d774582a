"""``features``: runs as a table of numbers, on the screen or in a file."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.cli.output import Status, Stop, say, show_json

if TYPE_CHECKING:
    from wearlab.store import Store

ENDINGS = (".csv", ".nc")


def write_features(
    store: "Store", where: str, variables: Sequence[str] | None, out: Path | None, si: bool, as_json: bool
) -> Status:
    """Write the features of the runs that meet a condition."""
    if out is not None and out.suffix not in ENDINGS:
        raise Stop(f"{out}: features are written as {' or '.join(ENDINGS)}")
    table = store.features(where, variables=variables)
    if as_json:
        units = [{"name": column.name, "unit": column.unit_of(True) or None} for column in table.columns]
        values = table.to_dict(si=True)
        rows = [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]
        show_json({"columns": units, "rows": rows})
        return Status.WELL
    if out is None:
        say(table.to_csv(si=si).rstrip("\n"))
        return Status.WELL
    try:
        if out.suffix == ".nc":
            table.to_xarray(si=si).to_netcdf(out)
        else:
            out.write_text(table.to_csv(si=si))
    except OSError as error:
        raise Stop(f"{out}: cannot be written ({error.strerror or error})") from error
    say(f"{out}: {len(table)} rows, {len(table.columns)} columns")
    return Status.WELL
