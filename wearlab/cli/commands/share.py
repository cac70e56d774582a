"""Stores that are handed on, trusted and tidied."""

from pathlib import Path
from typing import Any

from wearlab.cli import app, output
from wearlab.store import Store, files

MEGABYTE = 1e6
EXPORTS = ".nc, .zarr, .xlsx, .zip"


@app.command()
def export(file: str, out: Path, store: Store) -> output.Findings:
    """Write all runs of FILE as one file that needs no wearlab to be read.

    A crate holds its figures too.

    Parameters
    ----------
    out : OUT: out.nc, out.zarr (folder), out.xlsx, out.zip (crate).
    """
    from tempfile import TemporaryDirectory

    from wearlab.report import workbook
    from wearlab.store import export as exports

    if out.suffix.lower() not in EXPORTS.split(", "):
        raise output.Stop(
            f"{out}: an export is written as {EXPORTS}, not as "
            f"{out.suffix or 'nothing'}"
        )
    campaign = output.read_campaign(file)
    with output.refusing(OSError):
        total = len({case.id for case in campaign.cases})
        with output.bar(total, "runs") as tell:
            if out.suffix.lower() == ".zip":
                with TemporaryDirectory(prefix="wearlab-") as figures:
                    drawn, _ = output.drawn(campaign, store, Path(figures))
                    exports.export_crate(campaign, store, out, drawn, tell)
            elif out.suffix.lower() == ".xlsx":
                image = workbook.workbook(
                    store.open(campaign), exports.export_attributes(campaign, store)
                )
                files.write_whole(out, image)
            else:
                exports.export(campaign, store, out, tell)
        entries = store.archive.entries(case.id for case in campaign.cases).values()
    done = sum(entry.state == "done" for entry in entries)
    content = {"file": str(out), "runs": total, "done": done}
    if done == total:
        return output.Findings(content, [str(out)])
    lacking = (
        f"{total - done} of {total} runs have no data; the attribute 'missing' names "
        "them"
    )
    return output.Findings(content, [str(out)], False, [lacking])


@app.command()
def merge(other: Path, store: Store) -> output.Findings:
    """Take the runs of the store OTHER into this one, each verified.

    Parameters
    ----------
    other : OTHER: Another store.
    """
    return _merged(Store(other), store)


def _merged(theirs: Store, store: Store) -> output.Findings:
    """Take runs from one store into another."""
    from wearlab.store import merging

    with output.bar(len(theirs.archive.entries()), "runs") as tell:
        made = merging.merge(store, theirs, tell)
    runs = f"{len(made.copied)} runs copied, {len(made.same)} were here already"
    remarks = f", {made.remarks} tags and notes" if made.remarks else ""
    text = [
        f"{runs}, {made.campaigns} campaigns and {made.updates} updates copied{remarks}"
    ]
    text += [
        f"repaired: run {run_id}: its file here was damaged" for run_id in made.repaired
    ]
    wrong = [
        f"conflict: run {run_id} has other results here; ours stay"
        for run_id in made.conflicting
    ]
    wrong += [
        f"not taken over: {run_id}: {reason}" for run_id, reason in made.damaged.items()
    ]
    return output.Findings(vars(made), text, not wrong, wrong)


@app.command()
def pull(other: Path, store: Store) -> output.Findings:
    """Bring here what the store OTHER has and this one has not, each run verified.

    The same as merge.

    Parameters
    ----------
    other : OTHER: A folder, or https://… or s3://…
    """
    return _merged(Store(other), store)


@app.command()
def push(other: Path, store: Store) -> output.Findings:
    """Bring to the store OTHER what this one has and that one has not, each run verified.

    Parameters
    ----------
    other : OTHER: The folder to bring them to.
    """
    return _merged(store, Store(other))


@app.command()
def prune(
    store: Store, keep: list[str] | None = None, yes: bool = False
) -> output.Findings:
    """Show the runs that no campaign refers to, and remove them with --yes.

    Parameters
    ----------
    keep : FILE: A campaign whose runs stay.
    yes : Remove them; otherwise only say what would go.
    """
    from wearlab.store import pruning

    kept = [case.id for file in keep or [] for case in output.read_campaign(file).cases]
    with output.refusing(OSError):
        removable = pruning.prunable(store, kept)
        freed = pruning.prune(store, removable) if yes else 0
    total = sum(run.bytes for run in removable)
    content = {
        "removed": yes,
        "bytes": freed if yes else total,
        "runs": [run._asdict() for run in removable],
    }
    rows = [
        (output.short(r.id), r.state, f"{r.bytes / MEGABYTE:.2f} MB", r.reason)
        for r in removable
    ]
    more = "; nothing was removed: --yes removes them" if removable else ""
    could = f"{len(removable)} runs can go, {total / MEGABYTE:.1f} MB{more}"
    said = (
        f"{len(removable)} runs removed, {freed / MEGABYTE:.1f} MB freed"
        if yes
        else could
    )
    table = [output.ShownTable(("id", "state", "size", "why"), rows)] if rows else []
    return output.Findings(content, [*table, said])


@app.command()
def reindex(store: Store) -> output.Findings:
    """Make the catalogue anew from the run files."""
    if not store.archive.files.folder.is_dir():
        raise output.Stop(f"{store.path}: there is no store here")
    problems = store.reindex()
    count = len(store.archive.entries())
    wrong = [f"left out: {problem.message}" for problem in problems]
    if count and not store.archive.catalogue.read("SELECT 1 FROM campaigns LIMIT 1"):
        anew = "'wearlab run FILE' records one anew, and computes nothing that is there"
        later = "until then prune does not know what is wanted"
        wrong.append(f"campaigns stand in no run's file: {anew}; {later}")
    content = {"runs": count, "left_out": _plain(problems)}
    return output.Findings(
        content, [f"{count} runs in the catalogue"], not problems, wrong
    )


def _plain(problems: list[Any]) -> list[dict[str, str]]:
    return [
        {"path": str(p.path), "kind": p.kind, "message": p.message} for p in problems
    ]


@app.command()
def cite(run: str, store: Store) -> output.Findings:
    """Print how to cite a run, and where it comes from."""
    from wearlab.store import provenance

    facts = provenance.facts_of(store, run)
    lacking = (
        "no author: write [metadata] author = [...] into the campaign file and run it "
        "again"
    )
    remarks = [] if "author" in facts else [lacking]
    return output.Findings(
        facts,
        [provenance.citation(facts), "", provenance.bibtex(facts)],
        remarks=remarks,
    )


@app.command()
def verify(store: Store) -> output.Findings:
    """Compare every run file with the hash of what was written."""
    problems = store.verify()
    done = sum(entry.state == "done" for entry in store.archive.entries().values())
    text = [
        f"{problem.kind:<11}{problem.path}: {problem.message}" for problem in problems
    ]
    text.append(f"{done} runs compared, {len(problems)} problems")
    return output.Findings(_plain(problems), text, not problems)
