"""The command line application, on which the files of ``commands`` register themselves."""

from typing import Annotated

import typer

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
