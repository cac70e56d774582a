"""The command line application: the register of its commands, and the exit status."""

import os
import pkgutil
import re
import sys
from collections.abc import Callable, Sequence
from functools import cache, wraps
from importlib import import_module
from inspect import Parameter, getdoc, signature
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

import typer
from typer.main import get_command

from wearlab.cli import commands, output
from wearlab.cli.output import Findings, Status, Stop, complain
from wearlab.version import __version__

COMMAND_FILES = ("plan", "run", "ls", "figures", "compare", "schema", "share")
"""The order in which help lists the files of ``commands``; others follow by name."""

PLUGINS_OPTION = "--plugins"
REFUSAL = re.compile(r"wearlab\..*Error")
"""Errors that wearlab refuses with a message; anything else is a fault."""

Function = TypeVar("Function", bound=Callable[..., Any])

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _print_version(requested: bool) -> None:
    """Print the version and leave, where ``--version`` was written."""
    if requested:
        output.say(f"wearlab {__version__}")
        raise typer.Exit


VersionSwitch = Annotated[
    bool,
    typer.Option(
        "--version", help="Print the version.", callback=_print_version, is_eager=True
    ),
]
PluginsSwitch = Annotated[
    bool,
    typer.Option(
        PLUGINS_OPTION,
        help="Run the plug-ins that campaign files name; also after a command.",
    ),
]
JsonSwitch = Annotated[bool, typer.Option("--json", help="Write JSON.")]
JSON_PARAMETER = Parameter(
    "json", Parameter.KEYWORD_ONLY, default=False, annotation=JsonSwitch
)


@app.callback()
def main_options(
    version: VersionSwitch = False, plugins: PluginsSwitch = False
) -> None:
    """Experiments and datasets of coupled gear wear and dynamics."""
    output.TRUST_PLUGINS.set(plugins)
    # unless an option names another folder
    folder = os.environ.get("WEARLAB_STORE") or output.STORE
    output.STORE_FOLDER.set(Path(folder))


def command(
    name: str | None = None, help: str | None = None
) -> Callable[[Function], Function]:
    """Register a function as a command of ``wearlab``.

    Typer reads its arguments and options from the annotations. A function that returns
    `Findings` takes ``--json`` as well.

    Parameters
    ----------
    name : of the command [the function's]
    help : what help says of it [the docstring]
    """

    def register(function: Function) -> Function:
        declared = signature(function)
        parameters = [
            parameter.replace(kind=Parameter.KEYWORD_ONLY)
            for parameter in declared.parameters.values()
        ]
        returned = declared.return_annotation
        if Findings in (returned, *get_args(returned)):
            parameters.append(JSON_PARAMETER)

        @wraps(function)
        def run_command(json: bool = False, **arguments: Any) -> Any:
            output.AS_JSON.set(json)
            result = function(**arguments)
            return output.write(result) if isinstance(result, Findings) else result

        shown = declared.replace(parameters=parameters)
        run_command.__signature__ = shown  # type: ignore[attr-defined]
        app.command(name, help=help or getdoc(function))(run_command)
        return function

    return register


def _import_commands() -> None:
    """Import the files of ``commands``: each registers what it defines.

    Everything heavy is imported by the command that needs it.
    """
    files = {module.name for module in pkgutil.iter_modules(commands.__path__)}
    for file in (*COMMAND_FILES, *sorted(files - set(COMMAND_FILES))):
        import_module(f"{commands.__name__}.{file}")


_import_commands()


def status_of(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    Trouble is one message on standard error.

    Parameters
    ----------
    arguments : words after ``wearlab`` [those of this process]
    """
    try:
        words = list(sys.argv[1:] if arguments is None else arguments)
        result = _commands()(
            args=_plugins_first(words), prog_name="wearlab", standalone_mode=False
        )
        sys.stdout.flush()
        return int(result or Status.WELL)
    except Stop as stop:
        complain(f"wearlab: {stop}")
        return stop.status
    except KeyboardInterrupt:
        complain("wearlab: interrupted")
        return Status.INTERRUPTED
    except BrokenPipeError:  # whoever read our output has stopped reading
        output.discard(sys.stdout)
        return Status.TROUBLE
    except OSError as error:
        if error.filename is not None or error.errno not in output.FULL:
            raise  # an error that names a file is a fault of ours
        output.discard(sys.stdout)
        complain(
            f"wearlab: cannot write to standard output or to the disk: {error.strerror}"
        )
        return Status.TROUBLE
    except Exception as error:
        message = _refusal_message(error)
        if message is None:
            raise
        complain(message)
        return Status.REFUSED


def _plugins_first(words: list[str]) -> list[str]:
    """Return the words with ``--plugins`` in front.

    Every command takes the option, but the application reads it.
    """
    if PLUGINS_OPTION not in words:
        return words
    return [PLUGINS_OPTION, *(word for word in words if word != PLUGINS_OPTION)]


def _refusal_message(error: Exception) -> str | None:
    """Return what to tell the user of an error, None where it is a fault of wearlab."""
    is_refusal = any(
        REFUSAL.fullmatch(f"{kind.__module__}.{kind.__name__}")
        for kind in type(error).__mro__
    )
    if is_refusal:
        return f"wearlab: {error}"

    # what the command line parser refuses formats itself
    format_message = getattr(error, "format_message", None)
    if format_message is None:
        return None
    is_help = type(error).__name__ == "NoArgsIsHelpError"
    return str(format_message()) if is_help else f"wearlab: {format_message()}"


@cache
def _commands() -> Any:
    """Return all commands, built once: typer takes longer than most commands run."""
    return get_command(app)


def main() -> None:
    """Run the command line and leave with its exit status."""
    output.fill_closed()
    sys.exit(status_of())
