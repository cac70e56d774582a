"""Stores that are handed on, trusted and tidied."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from wearlab.cli import app, options, output
from wearlab.store import Store, files

if TYPE_CHECKING:
    from wearlab.campaign import Campaign

MEGABYTE = 1e6
EXPORTS = ".nc, .zarr, .xlsx, .zip, .rexs"


@app.command(
    help="Write all runs of FILE as one file that needs no wearlab to be read; a crate "
    "holds its figures too. As .rexs the gears, loads and oil of its first case."
)
def export(
    file: options.CampaignFile,
    out: Annotated[
        Path,
        options.argument(
            "OUT", "out.nc, out.zarr (folder), out.xlsx, out.zip (crate), out.rexs."
        ),
    ],
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Write all runs of a campaign as one file."""
    if out.suffix.lower() not in EXPORTS.split(", "):
        raise output.Stop(
            f"{out}: an export is written as {EXPORTS}, not as "
            f"{out.suffix or 'nothing'}"
        )
    campaign = output.read_campaign(file)
    if out.suffix.lower() == ".rexs":
        return _exported_gear_unit(campaign, out)

    with output.refusing(OSError):
        _write_export(campaign, out, store)
        entries = store.archive.entries(case.id for case in campaign.cases).values()

    total = len({case.id for case in campaign.cases})
    done = sum(entry.state == "done" for entry in entries)
    content = {"file": str(out), "runs": total, "done": done}
    if done == total:
        return output.Findings(content, [str(out)])
    remark = (
        f"{total - done} of {total} runs have no data; the attribute 'missing' names "
        "them"
    )
    return output.Findings(content, [str(out)], False, [remark])


def _exported_gear_unit(campaign: "Campaign", out: Path) -> output.Findings:
    """Write the gears of the first case as REXS; say what has no place there."""
    from wearlab.rexs.document import RexsError
    from wearlab.rexs.export import export_rexs

    with output.refusing(RexsError, OSError):
        exported = export_rexs(campaign.cases[0].scene, campaign.title or out.stem)
        files.write_whole(out, exported.content)

    remarks = [f"no place in REXS: {key}" for key in exported.no_place]
    if len(campaign.cases) > 1:
        remarks.append(f"the first of {len(campaign.cases)} cases is written")
    content = {"file": str(out), "no_place": list(exported.no_place)}
    return output.Findings(content, [str(out)], True, remarks)


def _write_export(campaign: "Campaign", out: Path, store: Store) -> None:
    """Write the runs of a campaign in the format that the name of the file asks for."""
    from tempfile import TemporaryDirectory

    from wearlab.report import workbook
    from wearlab.store import export as exports

    total = len({case.id for case in campaign.cases})
    with output.bar(total, "runs") as advance:
        match out.suffix.lower():
            case ".zip":
                with TemporaryDirectory(prefix="wearlab-") as folder:
                    figures = output.draw_figures(campaign, store, Path(folder))
                    exports.export_crate(campaign, store, out, figures.files, advance)
            case ".xlsx":
                attributes = exports.export_attributes(campaign, store)
                image = workbook.workbook(store.open(campaign), attributes)
                files.write_whole(out, image)
            case _:
                exports.export(campaign, store, out, advance)


@app.command()
def merge(
    source: Annotated[Path, options.argument("OTHER", "Another store.")],
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Take the runs of the store OTHER into this one, each verified."""
    return _merge(Store(source), store)


def _merge(source: Store, target: Store) -> output.Findings:
    """Take runs from one store into another."""
    from wearlab.store import merging

    with output.bar(len(source.archive.entries()), "runs") as advance:
        merged = merging.merge(target, source, advance)
    runs = f"{len(merged.copied)} runs copied, {len(merged.same)} were here already"
    campaigns = f"{merged.campaigns} campaigns and {merged.updates} updates copied"
    remarks = f", {merged.remarks} tags and notes" if merged.remarks else ""
    text = [f"{runs}, {campaigns}{remarks}"]
    text += [
        f"repaired: run {run_id}: its file here was damaged"
        for run_id in merged.repaired
    ]
    text += [
        f"the same within the estimated error: run {run_id}, {difference}"
        for run_id, difference in merged.differences.items()
        if run_id in merged.same
    ]
    problems = [
        f"conflict: run {run_id} has other results here: {merged.differences[run_id]}; "
        "ours stay"
        for run_id in merged.conflicting
    ]
    problems += [
        f"not taken over: {run_id}: {reason}"
        for run_id, reason in merged.damaged.items()
    ]
    return output.Findings(vars(merged), text, not problems, problems)


@app.command(
    help="Bring here what the store OTHER has and this one has not, each run verified; "
    "the same as merge."
)
def pull(
    source: Annotated[
        Path, options.argument("OTHER", "A folder, or https://… or s3://…")
    ],
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Take the runs of another store into this one."""
    return _merge(Store(source), store)


@app.command(
    help="Bring to the store OTHER what this one has and that one has not, each run "
    "verified."
)
def push(
    target: Annotated[Path, options.argument("OTHER", "The folder to bring them to.")],
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Take the runs of this store into another one."""
    return _merge(store, Store(target))


@app.command()
def prune(
    store: options.StoreFolder = options.DEFAULT_STORE,
    keep: Annotated[
        list[str] | None,
        options.option("--keep", "A campaign whose runs stay.", "FILE"),
    ] = None,
    yes: Annotated[
        bool, options.option("--yes", "Remove them; otherwise only say what would go.")
    ] = False,
) -> output.Findings:
    """Show the runs that no campaign refers to, and remove them with --yes."""
    from wearlab.store import pruning

    campaigns = [output.read_campaign(file) for file in keep or []]
    ids = [case.id for campaign in campaigns for case in campaign.cases]
    with output.refusing(OSError):
        removable = pruning.prunable(store, ids)
        freed = pruning.prune(store, removable) if yes else 0

    total = sum(run.bytes for run in removable)
    content = {
        "removed": yes,
        "bytes": freed if yes else total,
        "runs": [run._asdict() for run in removable],
    }
    text: list[str | output.ShownTable] = []
    if removable:
        rows = [
            (
                output.short(run.id),
                run.state,
                f"{run.bytes / MEGABYTE:.2f} MB",
                run.reason,
            )
            for run in removable
        ]
        text.append(output.ShownTable(("id", "state", "size", "why"), rows))
    if yes:
        text.append(f"{len(removable)} runs removed, {freed / MEGABYTE:.1f} MB freed")
    else:
        hint = "; nothing was removed: --yes removes them" if removable else ""
        text.append(f"{len(removable)} runs can go, {total / MEGABYTE:.1f} MB{hint}")
    return output.Findings(content, text)


@app.command()
def reindex(store: options.StoreFolder = options.DEFAULT_STORE) -> output.Findings:
    """Make the catalogue anew from the run files."""
    archive = store.archive
    if not (archive.files.folder.is_dir() or archive.catalogue.path.is_file()):
        raise output.Stop(f"{store.path}: there is no store here")
    with output.watched("runs"):
        problems = store.reindex()
    count = len(store.archive.entries())
    remarks = [f"left out: {problem.message}" for problem in problems]
    if count and not store.archive.catalogue.read("SELECT 1 FROM campaigns LIMIT 1"):
        remarks.append(
            "campaigns stand in no run's file: 'wearlab run FILE' records one anew, "
            "and computes nothing that is there; until then prune does not know what "
            "is wanted"
        )
    content = {"runs": count, "left_out": _problems_content(problems)}
    text = [f"{count} runs in the catalogue"]
    return output.Findings(content, text, not problems, remarks)


def _problems_content(problems: list[Any]) -> list[dict[str, str]]:
    """Return problems of files as JSON has them."""
    return [
        {
            "path": str(problem.path),
            "kind": problem.kind,
            "message": problem.message,
        }
        for problem in problems
    ]


@app.command()
def cite(
    run: options.RunName, store: options.StoreFolder = options.DEFAULT_STORE
) -> output.Findings:
    """Print how to cite a run, and where it comes from."""
    from wearlab.store import provenance

    facts = provenance.facts_of(store, run)
    text = [provenance.citation(facts), "", provenance.bibtex(facts)]
    remarks = []
    if "author" not in facts:
        remarks.append(
            "no author: write [metadata] author = [...] into the campaign file and run "
            "it again"
        )
    return output.Findings(facts, text, remarks=remarks)


@app.command()
def verify(
    export: Annotated[
        Path | None, options.argument("EXPORT", "An exported netCDF file.")
    ] = None,
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Compare every run file, or an EXPORT, with the hash of what was written."""
    if export is not None:
        return _verify_export(export)
    with output.watched("runs"):
        problems = store.verify()
    done = sum(entry.state == "done" for entry in store.archive.entries().values())
    text = [
        f"{problem.kind:<11}{problem.path}: {problem.message}" for problem in problems
    ]
    text.append(f"{done} runs compared, {len(problems)} problems")
    return output.Findings(_problems_content(problems), text, not problems)


def _verify_export(file: Path) -> output.Findings:
    """Compare an exported file with the hash that it carries."""
    from wearlab.store.export import verify_export

    problem = verify_export(file)
    if problem is None:
        return output.Findings([], [f"{file}: is what was exported"])
    text = f"{problem.kind:<11}{problem.path}: {problem.message}"
    return output.Findings(_problems_content([problem]), [text], False)
