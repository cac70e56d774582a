"""The command line application: the register of its commands, options that several share, the exit status."""

import inspect
import os
import pkgutil
import re
import sys
from collections.abc import Callable, Sequence
from functools import cache, wraps
from importlib import import_module
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

import typer
from typer.main import get_command

from wearlab.cli import commands, output
from wearlab.cli.output import Findings, Status, Stop, complain
from wearlab.store import Store
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
        output.say(f"wearlab {__version__}")
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
    output.TRUSTED.set(plugins)
    output.ASKED.set(Path(os.environ.get("WEARLAB_STORE") or output.STORE))  # unless an option names another


Function = TypeVar("Function", bound=Callable[..., Any])
Json = Annotated[bool, typer.Option("--json", help="Write JSON.")]
LISTED = "\n\nParameters\n----------\n"
OPTION = re.compile(r"(?:(\[?[A-Z]\S*)(?: from (\d+)(?: to (\d+))?)?(?: \[(.+?)\])?: )?(.*)")


def command(name: str | None = None) -> Callable[[Function], Function]:
    """Register a function as a command; its docstring tells what help says of it and of its options.

    A line of its ``Parameters`` is ``name : METAVAR from 0 to 9 [default in words]: help``, with what it
    needs of all before the help. What has no default, or a METAVAR in brackets, is an argument; an option
    that is a word of Python bears an underline behind it. Annotated parameters tell of themselves. What
    returns `Findings` takes ``--json``.
    """

    def register(function: Function) -> Function:
        text, _, listed = str(inspect.getdoc(function)).partition(LISTED)
        hints = get_type_hints(function, include_extras=True)
        parameters = inspect.signature(function).parameters
        for line in listed.splitlines():
            option, _, words = line.partition(" : ")
            named, least, most, default, told = OPTION.fullmatch(words).groups()  # type: ignore[union-attr]
            metavar = named and named.strip("[]")
            shown: dict[str, Any] = {"metavar": metavar, "help": told, "show_default": default or True}
            shown |= {"min": least and int(least), "max": most and int(most)}
            if parameters[option].default is inspect.Parameter.empty or metavar != named:
                declared: Any = typer.Argument(**shown | {"show_default": False})
            else:
                declared = typer.Option(f"--{option.rstrip('_').replace('_', '-')}", **shown)
            hints[option] = Annotated[hints[option], declared]

        @wraps(function)
        def run(json: bool = False, **given: Any) -> Any:
            output.AS_JSON.set(json)
            found = function(**given)
            return output.tell(found) if isinstance(found, Findings) else found

        options = [parameter.replace(annotation=hints[name]) for name, parameter in parameters.items()]
        if Findings in (hints["return"], *get_args(hints["return"])):
            options.append(Parameter("json", Parameter.KEYWORD_ONLY, default=False, annotation=Json))
        run.__signature__ = Signature(options)  # type: ignore[attr-defined]
        app.command(name, help=text)(run)
        return function

    return register


def _asked(folder: str) -> Store:
    output.ASKED.set(Path(folder))
    return Store(Path(folder))


File = Annotated[str, typer.Argument(metavar="FILE", help="A campaign file (TOML).", show_default=False)]
STORE: Any = output.STORE

StoreFolder = Annotated[
    Store,
    typer.Option(
        "--store", parser=_asked, metavar="DIR", envvar="WEARLAB_STORE", help="The folder of the runs."
    ),
]
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

FIRST = ("plan", "run", "ls", "figures", "compare", "accuracy", "schema", "share")
"""The order in which help lists the files of ``commands``; others follow by name."""


TRUST = "--plugins"
OURS = re.compile(r"wearlab\..*Error")
"""What wearlab refuses with a message; anything else is a fault."""


# everything heavy is imported by the command that needs it
_modules = {module.name for module in pkgutil.iter_modules(commands.__path__)}
for _name in [*FIRST, *sorted(_modules.difference(FIRST))]:
    import_module(f"{commands.__name__}.{_name}")


def status_of(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; trouble is one message on standard error.

    Parameters
    ----------
    arguments : words after ``wearlab`` [those of this process]
    """
    try:
        words = list(sys.argv[1:] if arguments is None else arguments)
        front = [TRUST] * (TRUST in words)  # every command takes it, the application reads it
        words = front + [word for word in words if word != TRUST]
        result = _commands()(args=words, prog_name="wearlab", standalone_mode=False)
        sys.stdout.flush()
        return int(result or Status.WELL)
    except Stop as stop:
        complain(f"wearlab: {stop}")
        return stop.status
    except KeyboardInterrupt:
        complain("wearlab: interrupted")
        return Status.INTERRUPTED
    except BrokenPipeError:  # whoever read our output has seen enough
        output.nowhere(sys.stdout)
        return Status.TROUBLE
    except OSError as error:
        return _unwritten(error)
    except Exception as error:
        return _misuse(error)


@cache
def _commands() -> Any:
    """Return all commands, which take typer longer to read than most take to run."""
    return get_command(app)


def _unwritten(error: OSError) -> int:
    """Tell in one message what is full; a file that has a name, or another error, is a fault of ours."""
    if error.filename is not None or error.errno not in output.FULL:
        raise error
    output.nowhere(sys.stdout)
    complain(f"wearlab: cannot write to standard output or to the disk: {error.strerror}")
    return Status.TROUBLE


def _misuse(error: Exception) -> int:
    """Tell what wearlab refuses, or a wrong command, in one message; a fault of ours keeps its traceback."""
    if any(OURS.fullmatch(f"{kind.__module__}.{kind.__name__}") for kind in type(error).__mro__):
        complain(f"wearlab: {error}")
        return Status.REFUSED
    tell = getattr(error, "format_message", None)
    if tell is None:
        raise error
    complain(tell() if type(error).__name__ == "NoArgsIsHelpError" else f"wearlab: {tell()}")
    return Status.REFUSED


def main() -> None:
    """Run the command line and leave with its exit status."""
    output.fill_closed()
    sys.exit(status_of())
