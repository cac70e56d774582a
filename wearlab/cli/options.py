"""Arguments and options that several commands take, each declared once."""

from pathlib import Path
from typing import Annotated, Any

import typer

from wearlab.cli import output
from wearlab.store import Store

DEFAULT_STORE: Any = output.STORE
"""Default of an option of type `StoreFolder`, before its parser opens it."""


def argument(metavar: str, help: str, **settings: Any) -> Any:
    """Return the declaration of a positional argument.

    Parameters
    ----------
    metavar : how help calls it
    help : what help says of it
    settings : further settings of `typer.Argument`
    """
    return typer.Argument(metavar=metavar, help=help, show_default=False, **settings)


def option(name: str, help: str, metavar: str | None = None, **settings: Any) -> Any:
    """Return the declaration of an option.

    Parameters
    ----------
    name : with its dashes
    help : what help says of it
    metavar : how help calls its value; of a switch None
    settings : further settings of `typer.Option`; ``show_default`` may be the default
        in words
    """
    return typer.Option(name, metavar=metavar, help=help, **settings)


def open_store(folder: str) -> Store:
    """Return the store of a folder, and note it as the store of this command.

    Parameters
    ----------
    folder : path of the folder
    """
    path = Path(folder)
    output.STORE_FOLDER.set(path)
    return Store(path)


CAMPAIGN_HELP = "A campaign file (TOML)."
RUN_HELP = 'An id, its beginning, or a condition that one run meets: "speed = 900 rpm".'
RUN_OR_CAMPAIGN_HELP = (
    "An id, its beginning, or a condition that one run meets; with --campaign a title "
    "or file name."
)
WHERE_HELP = 'Such as "torque > 100 N*m and life < 2e7".'

CampaignFile = Annotated[str, argument("FILE", CAMPAIGN_HELP)]
OptionalCampaignFile = Annotated[str | None, argument("FILE", CAMPAIGN_HELP)]
RunName = Annotated[str, argument("RUN", RUN_HELP)]
RunOrCampaign = Annotated[str, argument("RUN", RUN_OR_CAMPAIGN_HELP)]
StoreFolder = Annotated[
    Store,
    option(
        "--store",
        "The folder of the runs.",
        "DIR",
        parser=open_store,
        envvar="WEARLAB_STORE",
    ),
]
Where = Annotated[str, option("--where", WHERE_HELP, "EXPR")]
Workers = Annotated[
    int | None,
    option("--workers", "Worker processes.", "N", min=1, show_default="the cores"),
]
