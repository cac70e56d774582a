"""The command line as a whole: all commands, and the exit status of one."""

import os
import pkgutil
import re
import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

from typer.main import get_command

from wearlab.cli import commands
from wearlab.cli.output import ASKED, FULL, STORE, Status, Stop, complain, fill_closed, nowhere
from wearlab.cli.registry import app

FIRST = (*("plan", "run", "ls", "show", "figures", "compare", "accuracy", "schema", "share"),)
"""The order in which help lists the files of ``commands``; others follow by name."""


TRUST = "--plugins"
OURS = re.compile(r"wearlab\..*Error")
"""What wearlab refuses with a message; anything else is a fault."""


def _register() -> None:
    """Import every file of ``commands``; everything heavy is imported by the command that needs it."""
    modules = {module.name for module in pkgutil.iter_modules(commands.__path__)}
    for name in [*FIRST, *sorted(modules.difference(FIRST))]:
        import_module(f"{commands.__name__}.{name}")


_register()


def status_of(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; trouble is one message on standard error.

    Parameters
    ----------
    arguments : words after ``wearlab`` [those of this process]
    """
    try:
        words = list(sys.argv[1:] if arguments is None else arguments)
        ASKED.set(_store_of(words))
        result = _commands()(args=_trust_first(words), prog_name="wearlab", standalone_mode=False)
        sys.stdout.flush()
        return int(result or Status.WELL)
    except Stop as stop:
        complain(f"wearlab: {stop}")
        return stop.status
    except KeyboardInterrupt:
        complain("wearlab: interrupted")
        return Status.INTERRUPTED
    except BrokenPipeError:  # whoever read our output has seen enough
        nowhere(sys.stdout)
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
    if error.filename is not None or error.errno not in FULL:
        raise error
    nowhere(sys.stdout)
    complain(f"wearlab: cannot write to standard output or to the disk: {error.strerror}")
    return Status.TROUBLE


def _trust_first(words: list[str]) -> list[str]:
    """Return the words with ``--plugins``, which every command takes, in front of the command."""
    rest = [word for word in words if word != TRUST]
    return rest if len(rest) == len(words) else [TRUST, *rest]


def _store_of(words: list[str]) -> Path:
    """Return the store that a command is about: files are read before it is opened."""
    given = [word.removeprefix("--store=") for word in words if word.startswith("--store=")]
    given += [after for word, after in pairwise(words) if word == "--store"]
    return Path(given[-1] if given else os.environ.get("WEARLAB_STORE") or STORE)


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
    fill_closed()
    sys.exit(status_of())
