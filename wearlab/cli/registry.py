"""The command line application, its commands' register, and the options that several of them share."""

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

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


Function = TypeVar("Function", bound=Callable[..., Any])
LISTED = "\n\nParameters\n----------\n"
OPTION = re.compile(r"(?:([A-Z]\S*)(?: \[(.+?)\])?: )?(.*)")


def command(name: str | None = None) -> Callable[[Function], Function]:
    """Register a function as a command; its docstring tells what help says of it and of its options.

    A line of its ``Parameters`` is ``name : METAVAR [default in words]: help``, both before the help left out
    where there are none. What has no default is an argument; an option that is a word of Python bears an
    underline behind it. Annotated parameters tell of themselves.
    """

    def register(function: Function) -> Function:
        text, _, listed = str(inspect.getdoc(function)).partition(LISTED)
        hints, parameters = (
            get_type_hints(function, include_extras=True),
            inspect.signature(function).parameters,
        )
        parameters = inspect.signature(function).parameters
        for line in listed.splitlines():
            option, _, words = line.partition(" : ")
            metavar, default, told = OPTION.fullmatch(words).groups()  # type: ignore[union-attr]
            shown: dict[str, Any] = {"metavar": metavar, "help": told, "show_default": default or True}
            if parameters[option].default is inspect.Parameter.empty:
                declared: Any = typer.Argument(**shown | {"show_default": False})
            else:
                declared = typer.Option(f"--{option.rstrip('_')}", **shown)
            hints[option] = Annotated[hints[option], declared]
        function.__annotations__ = hints
        app.command(name, help=text)(function)
        return function

    return register


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
