"""Stores that are handed on, trusted and tidied."""

from pathlib import Path

from wearlab.cli import app, output
from wearlab.store import Store

MEGABYTE = 1e6
EXPORTS = (".nc", ".zarr", ".xlsx", ".zip")


@app.command()
def export(
    file: app.File, out: Path, folder: app.StoreFolder = app.STORE, json: app.Json = False
) -> output.Status:
    """Write all runs of FILE as one file that needs no wearlab to be read; a crate holds its figures too.

    Parameters
    ----------
    out : OUT: out.nc, out.zarr (folder), out.xlsx, out.zip (crate).
    """
    from tempfile import TemporaryDirectory

    from wearlab.report import workbook
    from wearlab.store import export as exports
    from wearlab.store import files

    if out.suffix.lower() not in EXPORTS:
        other = out.suffix or "nothing"
        raise output.Stop(f"{out}: an export is written as {', '.join(EXPORTS)}, not as {other}")
    store, campaign = Store(folder), output.read_campaign(file)
    with output.refusing(OSError):
        total = len({case.id for case in campaign.cases})
        with output.bar(total, json, "runs") as tell:
            if out.suffix.lower() == ".zip":
                with TemporaryDirectory(prefix="wearlab-") as figures:
                    drawn, _ = output.drawn(campaign, store, Path(figures))
                    exports.export_crate(campaign, store, out, drawn, tell)
            elif out.suffix.lower() == ".xlsx":
                image = workbook.workbook(store.open(campaign), exports.export_attributes(campaign, store))
                files.write_whole(out, image)
            else:
                exports.export(campaign, store, out, tell)
        entries = store.entries(case.id for case in campaign.cases)
    done = sum(entry.state == "done" for entry in entries.values())
    output.tell({"file": str(out), "runs": total, "done": done}, json, str(out))
    if done < total and not json:
        output.complain(f"{total - done} of {total} runs have no data; the attribute 'missing' names them")
    return output.Status.WELL if done == total else output.Status.TROUBLE


@app.command()
def merge(other: Path, folder: app.StoreFolder = app.STORE, json: app.Json = False) -> output.Status:
    """Take the runs of the store OTHER into this one, each verified.

    Parameters
    ----------
    other : OTHER: Another store.
    """
    from wearlab.store import upkeep

    theirs, store = Store(other), Store(folder)
    total = len(theirs.entries())
    with output.bar(total, json, "runs") as tell:
        made = upkeep.merge(store, theirs, tell)
    if json:
        output.show_json(vars(made))
    else:
        output.say(
            f"{len(made.copied)} runs copied, {len(made.same)} were here already, "
            f"{made.campaigns} campaigns and {made.updates} updates copied"
            f"{f', {made.remarks} tags and notes' if made.remarks else ''}"
        )
        for run_id in made.repaired:
            output.say(f"repaired: run {run_id}: its file here was damaged")
        for run_id in made.conflicting:
            output.complain(f"conflict: run {run_id} has other results here; ours stay")
        for run_id, reason in made.damaged.items():
            output.complain(f"not taken over: {run_id}: {reason}")
    return output.Status.TROUBLE if made.conflicting or made.damaged else output.Status.WELL


@app.command()
def pull(other: Path, folder: app.StoreFolder = app.STORE, json: app.Json = False) -> output.Status:
    """Bring here what the store OTHER has and this one has not, each run verified; the same as merge.

    Parameters
    ----------
    other : OTHER: A folder, or https://… or s3://…
    """
    return merge(other, folder, json)


@app.command()
def push(other: Path, folder: app.StoreFolder = app.STORE, json: app.Json = False) -> output.Status:
    """Bring to the store OTHER what this one has and that one has not, each run verified.

    Parameters
    ----------
    other : OTHER: The folder to bring them to.
    """
    return merge(folder, other, json)


@app.command()
def prune(
    folder: app.StoreFolder = app.STORE,
    keep: list[str] | None = None,
    yes: bool = False,
    json: app.Json = False,
) -> None:
    """Show the runs that no campaign refers to, and remove them with --yes.

    Parameters
    ----------
    keep : FILE: A campaign whose runs stay.
    yes : Remove them; otherwise only say what would go.
    """
    from wearlab.store import upkeep

    store = Store(folder)
    kept = [case.id for file in keep or [] for case in output.read_campaign(file).cases]
    with output.refusing(OSError):
        removable = upkeep.prunable(store, kept)
        freed = upkeep.prune(store, removable) if yes else 0
    total = sum(run.bytes for run in removable)
    if json:
        told = {"removed": yes, "bytes": freed if yes else total}
        return output.show_json(told | {"runs": [vars(run) for run in removable]})
    rows = [(output.short(r.id), r.state, f"{r.bytes / MEGABYTE:.2f} MB", r.reason) for r in removable]
    if rows:
        output.show_table(("id", "state", "size", "why"), rows)
    if yes:
        output.say(f"{len(removable)} runs removed, {freed / MEGABYTE:.1f} MB freed")
    else:
        more = "; nothing was removed: --yes removes them" if removable else ""
        output.say(f"{len(removable)} runs can go, {total / MEGABYTE:.1f} MB{more}")


@app.command()
def reindex(folder: app.StoreFolder = app.STORE, json: app.Json = False) -> output.Status:
    """Make the catalogue anew from the run files."""
    store = Store(folder)
    if not store.files.folder.is_dir():
        raise output.Stop(f"{store.path}: there is no store here")
    problems = store.reindex()
    count = len(store.entries())
    if json:
        left = [{"path": str(p.path), "kind": p.kind, "message": p.message} for p in problems]
        output.show_json({"runs": count, "left_out": left})
    else:
        for problem in problems:
            output.complain(f"left out: {problem.message}")
        if count and not store.catalogue.read("SELECT 1 FROM campaigns LIMIT 1"):
            output.complain(
                "campaigns stand in no run's file: 'wearlab run FILE' records one anew, and computes nothing "
                "that is there; until then prune does not know what is wanted"
            )
        output.say(f"{count} runs in the catalogue")
    return output.Status.TROUBLE if problems else output.Status.WELL


@app.command()
def cite(run: app.Run, folder: app.StoreFolder = app.STORE, json: app.Json = False) -> None:
    """Print how to cite a run, and where it comes from."""
    from wearlab.store import provenance

    facts = provenance.facts_of(Store(folder), run)
    if "author" not in facts and not json:
        output.complain("no author: write [metadata] author = [...] into the campaign file and run it again")
    output.tell(facts, json, provenance.citation(facts), "", provenance.bibtex(facts))


@app.command()
def verify(folder: app.StoreFolder = app.STORE, json: app.Json = False) -> output.Status:
    """Compare every run file with the hash of what was written."""
    store = Store(folder)
    problems = store.verify()
    done = sum(entry.state == "done" for entry in store.entries().values())
    found = [{"path": str(p.path), "kind": p.kind, "message": p.message} for p in problems]
    lines = [f"{p.kind:<11}{p.path}: {p.message}" for p in problems]
    output.tell(found, json, *lines, f"{done} runs compared, {len(problems)} problems")
    return output.Status.TROUBLE if problems else output.Status.WELL
