"""``export``, ``merge``, ``prune``, ``reindex``, ``cite``: stores that are handed on, trusted and tidied."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.cli.output import (
    REFUSALS,
    Status,
    complain,
    load_campaign,
    refusing,
    say,
    show_json,
    show_table,
)

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import Store

SHORT_ID = 10
MEGABYTE = 1e6


@contextmanager
def _counting(what: str, total: int, silent: bool) -> Iterator[Callable[[str], None]]:
    """Show on standard error how far a long work is; silent where nobody watches."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if silent or not console.is_terminal:
        yield lambda run_id: None
        return
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=total)
        yield lambda run_id: bar.advance(task)


def export_campaign(file: str, store: "Store", out: Path, as_json: bool) -> Status:
    """Write a campaign's runs as one file, or as a crate with its figures where the name ends in .zip."""
    from wearlab.store.export import export

    campaign = load_campaign(file)
    with refusing(*REFUSALS):
        total = len({case.id for case in campaign.cases})
        with _counting("runs", total, as_json) as tell:
            if out.suffix == ".zip":
                _export_crate(campaign, store, out, tell)
            else:
                export(campaign, store, out, tell)
        entries = store.entries(case.id for case in campaign.cases)
    done = sum(entry.state == "done" for entry in entries.values())
    if as_json:
        show_json({"file": str(out), "runs": total, "done": done})
    else:
        say(str(out))
        if done < total:
            complain(f"{total - done} of {total} runs have no data; the attribute 'missing' names them")
    return Status.WELL if done == total else Status.TROUBLE


def _export_crate(campaign: "Campaign", store: "Store", out: Path, tell: Callable[[str], None]) -> None:
    """Write a crate with every figure that can be drawn."""
    from tempfile import TemporaryDirectory

    from wearlab.figures import FigureError, draw
    from wearlab.store.crate import export_crate

    with TemporaryDirectory(prefix="wearlab-") as folder:
        try:
            drawn = tuple(draw(campaign, store, Path(folder)))
        except FigureError as error:
            complain(str(error))
            drawn = error.drawn
        export_crate(campaign, store, out, drawn, tell)


def merge_stores(other: "Store", store: "Store", as_json: bool) -> Status:
    """Take in the runs of another store."""
    from wearlab.store.merge import merge

    with refusing(*REFUSALS):
        total = len(other.entries())
        with _counting("runs", total, as_json) as tell:
            made = merge(store, other, tell)
    if as_json:
        show_json(vars(made))
    else:
        say(
            f"{len(made.copied)} runs copied, {len(made.same)} were here already, "
            f"{made.campaigns} campaigns and {made.updates} updates copied"
        )
        for run_id in made.repaired:
            say(f"repaired: run {run_id}: its file here was damaged")
        for run_id in made.conflicting:
            complain(f"conflict: run {run_id} has other results here; ours stay")
        for run_id, reason in made.damaged.items():
            complain(f"not taken over: {run_id}: {reason}")
    return Status.TROUBLE if made.conflicting or made.damaged else Status.WELL


def prune_store(store: "Store", files: list[str], really: bool, as_json: bool) -> Status:
    """Remove what no campaign refers to; without ``really`` only say what would go."""
    from wearlab.store.prune import prunable, prune

    kept = [case.id for file in files for case in load_campaign(file).cases]
    with refusing(*REFUSALS, OSError):
        removable = prunable(store, kept)
        freed = prune(store, removable) if really else 0
    total = sum(run.bytes for run in removable)
    if as_json:
        show_json(
            {"removed": really, "bytes": freed if really else total, "runs": [vars(run) for run in removable]}
        )
        return Status.WELL
    rows = [(r.id[:SHORT_ID], r.state, f"{r.bytes / MEGABYTE:.2f} MB", r.reason) for r in removable]
    if rows:
        show_table(("id", "state", "size", "why"), rows)
    if really:
        say(f"{len(removable)} runs removed, {freed / MEGABYTE:.1f} MB freed")
    else:
        more = "; nothing was removed: --yes removes them" if removable else ""
        say(f"{len(removable)} runs can go, {total / MEGABYTE:.1f} MB{more}")
    return Status.WELL


def reindex_store(store: "Store", as_json: bool) -> Status:
    """Make the catalogue anew from the run files."""
    from wearlab.cli.output import Stop

    if not store.files.folder.is_dir():
        raise Stop(f"{store.path}: there is no store here")
    with refusing(*REFUSALS):
        problems = store.reindex()
        count = len(store.entries())
    if as_json:
        left = [{"path": str(p.path), "kind": p.kind, "message": p.message} for p in problems]
        show_json({"runs": count, "left_out": left})
    else:
        for problem in problems:
            complain(f"left out: {problem.message}")
        if count and not store.catalogue.read("SELECT 1 FROM campaigns LIMIT 1"):
            complain(
                "campaigns stand in no run's file: 'wearlab run FILE' records one anew, and computes nothing "
                "that is there; until then prune does not know what is wanted"
            )
        say(f"{count} runs in the catalogue")
    return Status.TROUBLE if problems else Status.WELL


def cite_run(store: "Store", prefix: str, as_json: bool) -> Status:
    """Print how to cite a run, and where it comes from."""
    from wearlab.store.cite import bibtex, citation, facts_of

    with refusing(*REFUSALS):
        facts = facts_of(store, prefix)
    if as_json:
        show_json(facts)
    else:
        if "author" not in facts:
            complain("no author: write [metadata] author = [...] into the campaign file and run it again")
        say(citation(facts))
        say()
        say(bibtex(facts))
    return Status.WELL
