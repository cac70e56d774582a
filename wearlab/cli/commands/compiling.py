"""What campaigns need compiled, before their first run."""

from contextlib import ExitStack
from typing import Annotated

import typer

from wearlab.cli.options import Workers
from wearlab.cli.output import Status, read_campaign, say
from wearlab.cli.registry import app


@app.command("compile")
def compile_command(
    files: Annotated[
        list[str], typer.Argument(metavar="FILE...", help="Campaign files (TOML).", show_default=False)
    ],
    workers: Workers = None,
) -> Status:
    """Compile what the runs of FILEs will call, ahead of them: for an image, or before nodes begin."""
    from wearlab.cli.progress import bar
    from wearlab.runner.compiling import compile_ahead

    campaigns = [read_campaign(file) for file in files]
    with ExitStack() as open_bar:
        kinds, seconds = compile_ahead(
            campaigns, workers, lambda total: open_bar.enter_context(bar(total, silent=False))
        )
    say(f"compiled for {kinds} {'kind' if kinds == 1 else 'kinds'} of scenes in {seconds:.1f} s")
    return Status.WELL
