"""The command line application, its commands' register, and the options that several of them share."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.output import STORE as STORE
from wearlab.cli.output import TRUSTED, say
from wearlab.version import __version__

app = typer.Typer(
    name="wearlab",
    help="Experiments and datasets of coupled gear wear and dynamics.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _tell_version(asked: bool) -> None:
    if asked:
        say(f"wearlab {__version__}")
        raise typer.Exit


@app.callback()
def every_command(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_tell_version, is_eager=True)
    ] = False,
    plugins: Annotated[
        bool,
        typer.Option("--plugins", help="Run the plug-ins that campaign files name; also after a command."),
    ] = False,
) -> None:
    """Experiments and datasets of coupled gear wear and dynamics."""
    TRUSTED.set(plugins)


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
