"""The command line application: the register of its commands, options that several share, the exit status."""

import os
import pkgutil
import re
import sys
from collections.abc import Callable, Sequence
from functools import cache, wraps
from importlib import import_module
from inspect import Parameter, Signature, getdoc, signature
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

import typer
from typer.main import get_command

from wearlab.cli import commands, output
from wearlab.cli.output import Findings, Status, Stop, complain
from wearlab.store import Store
from wearlab.version import __version__

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _tell_version(asked: bool) -> None:
    if asked:
        output.say(f"wearlab {__version__}")
        raise typer.Exit


VERSION = typer.Option(
    "--version", help="Print the version.", callback=_tell_version, is_eager=True
)
TRUST = "--plugins"
PLUGINS = typer.Option(
    TRUST, help="Run the plug-ins that campaign files name; also after a command."
)


@app.callback()
def for_all(
    version: Annotated[bool, VERSION] = False, plugins: Annotated[bool, PLUGINS] = False
) -> None:
    """Experiments and datasets of coupled gear wear and dynamics."""
    output.TRUSTED.set(plugins)
    output.ASKED.set(
        Path(os.environ.get("WEARLAB_STORE") or output.STORE)
    )  # unless an option names another


def _asked(folder: str) -> Store:
    output.ASKED.set(Path(folder))
    return Store(Path(folder))


Function = TypeVar("Function", bound=Callable[..., Any])
WRITTEN = Annotated[bool, typer.Option("--json", help="Write JSON.")]
JSON = Parameter("json", Parameter.KEYWORD_ONLY, default=False, annotation=WRITTEN)
STORED: dict[str, Any] = {"parser": _asked, "envvar": "WEARLAB_STORE"}
SHARED = {
    "file": "FILE: A campaign file (TOML).",
    "run": 'RUN: An id, its beginning, or a condition that one run meets: "speed = '
    '900 rpm".',
    "store": "DIR: The folder of the runs.",
    "where": 'EXPR: Such as "torque > 100 N*m and life < 2e7".',
    "workers": "N from 1 [the cores]: Worker processes.",
}
"""What several commands take, told as by `command`; ``store`` is a `Store` and needs no
default."""
LISTED = "\n\nParameters\n----------\n"
OPTION = re.compile(
    r"(?:(\[?[A-Z]\S*)(?: from (\d+)(?: to (\d+))?)?(?: \[(.+?)\])?: )?(.*)"
)


def command(name: str | None = None) -> Callable[[Function], Function]:
    """Register a function as a command.

    Its docstring tells what help says of it and of its options.

    A line of its ``Parameters`` is ``name : METAVAR from 0 to 9 [default in words]:
    help``, with what it needs of all before the help. What has no default, or a METAVAR
    in brackets, is an argument; an option that is a word of Python bears an underline
    behind it. Of parameters without a line, `SHARED` tells. What returns `Findings`
    takes ``--json``.
    """

    def register(function: Function) -> Function:
        text, _, listed = str(getdoc(function)).partition(LISTED)
        entries = re.sub(r"\n +", " ", listed).splitlines()
        told = SHARED | dict(entry.split(" : ", 1) for entry in entries)
        hints = get_type_hints(function)
        options = []
        for key, parameter in signature(function).parameters.items():
            named, least, most, default, words = OPTION.fullmatch(told[key]).groups()  # type: ignore[union-attr]
            metavar = named and named.strip("[]")
            shown: dict[str, Any] = {
                "metavar": metavar,
                "help": words,
                "show_default": default or True,
            }
            shown |= {"min": least and int(least), "max": most and int(most)}
            if key == "store":
                shown = shown | STORED
                parameter = parameter.replace(default=output.STORE)
            if parameter.default is Parameter.empty or metavar != named:
                declared: Any = typer.Argument(**shown | {"show_default": False})
            else:
                declared = typer.Option(
                    f"--{key.rstrip('_').replace('_', '-')}", **shown
                )
            options.append(
                parameter.replace(
                    annotation=Annotated[hints[key], declared], kind=JSON.kind
                )
            )

        @wraps(function)
        def run(json: bool = False, **given: Any) -> Any:
            output.AS_JSON.set(json)
            found = function(**given)
            return output.tell(found) if isinstance(found, Findings) else found

        options += (
            [JSON] if Findings in (hints["return"], *get_args(hints["return"])) else []
        )
        run.__signature__ = Signature(options)  # type: ignore[attr-defined]
        app.command(name, help=text)(run)
        return function

    return register


FIRST = ("plan", "run", "ls", "figures", "compare", "schema", "share")
"""The order in which help lists the files of ``commands``; others follow by name."""


OURS = re.compile(r"wearlab\..*Error")
"""What wearlab refuses with a message; anything else is a fault."""


# everything heavy is imported by the command that needs it
for _name in [
    *FIRST,
    *sorted({one.name for one in pkgutil.iter_modules(commands.__path__)} - {*FIRST}),
]:
    import_module(f"{commands.__name__}.{_name}")


def status_of(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    Trouble is one message on standard error.

    Parameters
    ----------
    arguments : words after ``wearlab`` [those of this process]
    """
    try:
        words = list(sys.argv[1:] if arguments is None else arguments)
        # every command takes it, the application reads it
        words = [TRUST] * (TRUST in words) + [word for word in words if word != TRUST]
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
        if (
            error.filename is not None or error.errno not in output.FULL
        ):  # that has a name: a fault of ours
            raise
        output.nowhere(sys.stdout)
        complain(
            f"wearlab: cannot write to standard output or to the disk: {error.strerror}"
        )
        return Status.TROUBLE
    except Exception as error:
        ours = any(
            OURS.fullmatch(f"{kind.__module__}.{kind.__name__}")
            for kind in type(error).__mro__
        )
        tell = str if ours else getattr(type(error), "format_message", None)
        if tell is None:
            raise
        before = "" if type(error).__name__ == "NoArgsIsHelpError" else "wearlab: "
        complain(f"{before}{tell(error)}")
        return Status.REFUSED


@cache
def _commands() -> Any:
    """Return all commands, which take typer longer to read than most take to run."""
    return get_command(app)


def main() -> None:
    """Run the command line and leave with its exit status."""
    output.fill_closed()
    sys.exit(status_of())
