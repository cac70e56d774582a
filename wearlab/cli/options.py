"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.output import STORE as STORE

File = Annotated[str, typer.Argument(metavar="FILE", help="A campaign file (TOML).", show_default=False)]
StoreFolder = Annotated[
    Path, typer.Option("--store", metavar="DIR", envvar="WEARLAB_STORE", help="The folder of the runs.")
]
Json = Annotated[bool, typer.Option("--json", help="Write JSON.")]
Workers = Annotated[
    int | None, typer.Option(metavar="N", min=1, help="Worker processes.", show_default="the cores")
]
Run = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help='An id, its beginning, or a condition that one run meets: "speed = 900 rpm".',
        show_default=False,
    ),
]
Condition = Annotated[
    str, typer.Option("--where", metavar="EXPR", help='Such as "torque > 100 N*m and life < 2e7".')
]
