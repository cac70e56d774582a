"""Before a run: which campaigns and cases can be.

``check``, ``plan``, ``compile`` and ``modes``.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from wearlab.cli import app, options, output
from wearlab.store import Store, outcome
from wearlab.units import convert

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.campaign.axes import Axis
    from wearlab.campaign.claims import Checked
    from wearlab.runner.plan import Plan
    from wearlab.updating.cases import Subjects

MAX_AXIS_VALUES = 20  # of an axis that is listed in full
FIRST_VALUES = 3  # of a longer axis
MAX_KEYS = 6  # of scenes that were run before with other values


def refuse_the_impossible(campaign: "Campaign") -> list[dict[str, Any]]:
    """Return the cases whose gears, flanks or supports cannot be, and why.

    Each with whether the file expects the refusal.

    Parameters
    ----------
    campaign : its cases

    Raises
    ------
    Stop : not one case can be, and none is expected to be refused; nothing is written
        then
    """
    cases = {case.id: case for case in campaign.cases}
    refused: list[dict[str, Any]] = []
    for case in cases.values():
        reason = _refusal_of(case.scene)
        if reason is not None:
            refused.append(
                {
                    "case": output.case_name(campaign, case),
                    "id": case.id,
                    "reason": reason,
                    "expected": case.expect is not None
                    and case.expect.verdict == "refused",
                }
            )
    if len(refused) == len(cases) and not any(case["expected"] for case in refused):
        raise output.Stop("\n".join(_refusals_by_reason(refused)))
    return refused


def _refusal_of(scene: Any) -> str | None:
    """Return why the gears or supports of a scene cannot be, None if they can."""
    from wearlab.assembly import sets, vibration, wear_checks
    from wearlab.gears.specification import GearError

    try:
        for in_condition in scene.in_conditions():
            gears = sets.build_set(in_condition)
            vibration.check_held(in_condition, gears)
        wear_checks.check_initial_wear(scene, gears)
        wear_checks.check_limits(scene, gears)
    except GearError as error:
        return str(error)
    return None


def _refusals_by_reason(refused: list[dict[str, Any]]) -> Iterator[str]:
    """Yield a line for every reason, with the first case that it refuses."""
    names_by_reason: dict[str, list[str]] = {}
    for case in refused:
        names_by_reason.setdefault(case["reason"], []).append(case["case"])
    for reason, (name, *further) in names_by_reason.items():
        count = f" and {len(further)} more" if further else ""
        yield f"{name}{count}: {reason}"


def scenes_by_label(campaign: "Campaign") -> dict[str, Any]:
    """Return the scene of the first case of every label.

    Parameters
    ----------
    campaign : with its cases in order
    """
    scenes: dict[str, Any] = {}
    for case in campaign.cases:
        scenes.setdefault(case.label, case.scene)
    return scenes


@app.command(
    help="Show what FILE asks for: parts, cases, and which of them cannot be; or "
    "whether its claims hold."
)
def check(
    file: options.CampaignFile,
    claims: Annotated[
        bool,
        options.option(
            "--claims", "Hold what FILE says of its runs against those in the store."
        ),
    ] = False,
    measured: Annotated[
        Path | None,
        options.option(
            "--measured",
            "With --claims: against what it wrote with --json, of equal runs, not the "
            "store.",
            "JSON",
        ),
    ] = None,
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Check a campaign file without running it, or check its claims."""
    if claims:
        campaign = output.read_drawable_campaign(file)
        return _check_claims(campaign, measured or store)
    if measured:
        raise output.Stop("--measured holds claims: write --claims, too")

    from wearlab.scene import parts_left_out, parts_present

    campaign = output.read_drawable_campaign(file)
    refused = refuse_the_impossible(campaign)
    scenes = scenes_by_label(campaign)
    sheets = _gear_sheets(scenes)
    content: dict[str, Any] = {
        "title": campaign.title,
        "cases": len(campaign.cases),
        "runs": len({case.id for case in campaign.cases}),
        "axes": [
            {"name": axis.name, "values": axis.values, "units": axis.units}
            for axis in campaign.axes
        ],
        "parts": {
            label: {"present": parts_present(scene), "left_out": parts_left_out(scene)}
            for label, scene in scenes.items()
        },
        "gears": {label: table.rows for label, table in sheets.items()},
        "refused": refused,
        "warnings": campaign.warnings,
    }
    text = _check_text(campaign, scenes, content, sheets)
    return output.Findings(content, text, all(case["expected"] for case in refused))


def _check_text(
    campaign: "Campaign",
    scenes: dict[str, Any],
    content: dict[str, Any],
    sheets: dict[str, output.ShownTable],
) -> output.Text:
    """Yield what a campaign asks for; what is wrong with it goes to standard error."""
    yield campaign.title
    for axis in campaign.axes:
        yield _axis_line(axis)
    yield f"  {content['cases']} cases, {content['runs']} runs"

    for label, parts in content["parts"].items():
        yield f"\n{label}"
        for part in parts["present"]:
            yield f"  + {part}"
        yield f"  left out: {', '.join(parts['left_out']) or 'nothing'}"
    for label, table in sheets.items():
        yield f"\ngears of {label}"
        yield table
    for label, scene in scenes.items():
        yield from _duty(label, scene)
    if campaign.update is not None:
        yield from _update(campaign)

    for warning in campaign.warnings:
        output.complain(f"\nwarning: {warning}")
    for case in content["refused"]:
        expected = ", as expected" if case["expected"] else ""
        output.complain(f"\nrefused{expected}: {case['case']}: {case['reason']}")


def _axis_line(axis: "Axis") -> str:
    """Return name and values of an axis, of a long one the first and the last."""
    values = axis.values
    if len(values) > MAX_AXIS_VALUES:
        values = (*values[:FIRST_VALUES], "…", values[-1])
    listed = ", ".join(outcome.value_text(value, None) for value in values)
    line = f"  {axis.name}: {listed} {axis.units or ''}".rstrip()
    is_shortened = len(values) != len(axis.values)
    return f"{line} ({len(axis.values)} values)" if is_shortened else line


def _duty(label: str, scene: Any) -> output.Text:
    """Yield the load spectrum of a scene as it was read."""
    blocks = scene.operation.blocks
    if not blocks:
        return
    table = scene.duty_table
    source = "" if table is None else f", {table.file}: {table.understood}"
    yield f"\nload spectrum of {label}{source}"

    until = scene.wear and scene.wear.until
    hours = (until and until.hours) or 1000.0
    work = {"front": 0.0, "back": 0.0}  # torque times speed, as linear wear has it
    for block in blocks:
        work[block.side] += block.share * abs(block.torque) * block.speed
    rows = []
    for block in blocks:
        speed = convert(block.speed, "rad/s", "rpm")
        power = 1e-3 * block.torque * block.speed
        cycles = 60.0 * speed * hours * block.share
        numbers = (block.torque, speed, 100.0 * block.share, power, cycles)
        texts = [f"{number:.6g}" for number in numbers]
        if block.is_loaded:
            of_side = block.share * abs(block.torque) * block.speed / work[block.side]
            texts += [block.side, f"{100.0 * of_side:.4g}"]
        else:
            texts += ["none", ""]
        rows.append(texts)
    mean = sum(block.share * block.torque * block.speed for block in blocks)
    rows.append(["mean", "", "100", f"{1e-3 * mean:.6g}", "", "", ""])
    heads = ["torque [N·m]", "speed [rpm]", "share [%]", "power [kW]"]
    heads += [f"turns in {hours:g} h", "flanks", "of their wear [%]"]
    yield output.ShownTable(heads, rows)


def _update(campaign: "Campaign") -> output.Text:
    """Yield the unknowns, measurements and limits of a campaign's [update].

    Raises
    ------
    UpdateError : its data cannot be read, or it cannot be updated
    """
    from wearlab.schema import VARIABLES
    from wearlab.updating.cases import studies
    from wearlab.updating.measurements import reach_text

    for group in _groups_of(studies(campaign)):
        study = group[0]
        is_fleet = len(group) > 1
        yield f"\nupdate of {f'{len(group)} units' if is_fleet else study.label}"

        for key, prior in study.spec.unknown.items():
            cost = "" if key not in study.costly else f", {study.spec.draws} runs"
            range_ = f"{prior.at(0.05):.4g} to {prior.at(0.95):.4g} {prior.unit or ''}"
            yield f"  unknown: {key}, before {range_}{cost}"

        # of every block of data the observations of all units
        for observations in zip(*(unit.observations for unit in group), strict=True):
            data = observations[0].data
            count = sum(map(len, observations))
            line = (
                f"  measured: {count} values of {data.label.replace('_', ' ')} in "
                f"{data.file.name}"
            )
            if is_fleet:
                counts = (
                    f"{unit.label} {len(observation)}"
                    for unit, observation in zip(group, observations, strict=True)
                )
                line += f": {', '.join(counts)}"
            first = observations[0]
            if first.unread:
                line += f"; when, by {first.clock}: not by {', '.join(first.unread)}"
            yield line
            if count:
                yield f"    {reach_text(observations)}"

        for limit in dict.fromkeys(unit.limit for unit in group):
            where = f" of the {limit.where}" if limit.where else ""
            variable = VARIABLES[limit.quantity]
            level = convert(limit.value, variable.units, variable.display_units)
            yield (
                f"  limit: {variable.long_name}{where}, {level:.4g} "
                f"{variable.display_units}"
            )


def _groups_of(subjects: "Subjects") -> "list[Subjects]":
    """Return what is listed together: the units of a fleet, or each case by itself."""
    if subjects[0].spec.fleet is not None:
        return [subjects]
    return [(study,) for study in subjects]


def _check_claims(campaign: "Campaign", source: "Store | Path") -> output.Findings:
    """Return whether the claims of a campaign hold.

    The numbers come from the runs of a store, or from a file that ``check --claims
    --json`` wrote.
    """
    from wearlab.campaign import claims, statements

    if isinstance(source, Store):
        record = claims.measure(campaign, source.open(campaign))
        stale = ""
    else:
        with output.refusing(OSError, ValueError):
            record = claims.ClaimRecord.read(source.read_bytes(), str(source))
        stale = claims.stale(campaign, record)

    checked, unfilled = claims.check_record(campaign, record, stale)
    with output.refusing(OSError, ValueError):
        unheld = statements.problems(campaign, record)
    recorded = {claim.name: claim.model_dump() for claim in record.claims}
    rows = [
        recorded.get(result.claim.name, {})
        | result.claim.model_dump(exclude_none=True)
        | {
            "measured": result.measured,
            "reason": result.reason,
            "holds": result.holds,
        }
        for result in checked
    ]
    content = {
        "title": campaign.title,
        **record.model_dump(),
        "claims": rows,
        "unfilled": unfilled,
        "unheld": unheld,
    }
    failures = [*unfilled, *unheld]
    ok = all(result.holds for result in checked) and not failures
    return output.Findings(content, _claims_text(campaign.title, checked, failures), ok)


def _claims_text(
    title: str, checked: "list[Checked]", failures: list[str]
) -> output.Text:
    """Yield the claims that hold; those that fail go to standard error."""
    for result in checked:
        claim = result.claim
        if result.measured is None:
            value = result.reason
        else:
            value = f"{result.measured:.4g} {claim.unit}".rstrip()
        line = f"{claim.name}: {value}; claimed {claim.value} within {claim.tolerance}"
        if result.holds:
            yield f"holds  {line}"
        else:
            output.complain(f"fails  {line}")
    for problem in failures:
        output.complain(f"fails  {problem}")
    count = sum(result.holds for result in checked)
    yield f"{count} of {len(checked)} claims hold: {title}"


def _gear_sheets(scenes: dict[str, Any]) -> dict[str, output.ShownTable]:
    """Return the dimensions of the gears by label, equal ones under the first label."""
    from wearlab.assembly import sheet
    from wearlab.gears.specification import GearError

    sheets: dict[str, output.ShownTable] = {}
    for label, scene in scenes.items():
        with suppress(GearError):  # listed as refused
            gears = sheet.sheet(scene)
            count = len(gears.members)
            rows = []
            for row in gears.rows:
                # what all gears share stands in the first column
                cells = [*row.values, *[""] * count][:count]
                rows.append((row.symbol, row.meaning, *cells, row.unit))
            table = output.ShownTable(("", "", *gears.members, "unit"), rows)
            if table not in sheets.values():
                sheets[label] = table
    return sheets


@app.command(
    help="Show what run would do with FILE: new, cached, excluded, failed before; time "
    "and disk space."
)
def plan(
    file: options.CampaignFile,
    store: options.StoreFolder = options.DEFAULT_STORE,
    workers: options.Workers = None,
    retry: Annotated[
        bool, options.option("--retry", "Count failed and refused cases too.")
    ] = False,
) -> output.Findings:
    """Show what ``wearlab run`` would do."""
    from wearlab.runner.plan import plan as plan_runs

    campaign = output.read_campaign(file)
    planned = plan_runs(campaign, store, workers=workers, retry=retry)
    text = _plan_text(planned)
    if campaign.update is not None:
        text = chain(text, _update_plan_text(campaign, store, workers))
    warnings = [f"warning: {warning}" for warning in planned.warnings]
    return output.Findings(
        partial(_plan_content, planned), text, not warnings, warnings
    )


def _plan_content(planned: "Plan") -> dict[str, Any]:
    """Return a plan as JSON has it."""
    seconds = planned.seconds
    size = planned.bytes
    return asdict(planned) | {
        "seconds": seconds and seconds._asdict(),
        "bytes": size and size._asdict(),
        "runs": [run._asdict() for run in planned.runs],
    }


def _plan_text(planned: "Plan") -> output.Text:
    """Yield a plan: how many runs of each state, and what the new ones need."""
    yield planned.title
    yield (
        f"  {planned.cases} cases, {len(planned.runs)} distinct runs, "
        f"{len(planned.excluded)} excluded"
    )
    yield from _counts(planned)
    for run in planned.runs:
        if run.state in ("failed", "refused", "lost"):
            yield f"  {run.state}: {output.in_words(run.label, run.position)}"
    yield from _needs(planned)


def _counts(planned: "Plan") -> Iterator[str]:
    """Yield how many runs are in each state, differ in which keys, are excluded."""
    from wearlab.runner.plan import WORDS

    for state, label in WORDS.items():
        if count := planned.count(state):
            yield f"  {count:>7} {label}"
    if count := sum(run.other_code for run in planned.runs):
        yield f"  {count:>7} of the cached made by other code"

    changed_keys = Counter(run.changed for run in planned.runs if run.changed)
    for keys, count in changed_keys.items():
        further = f" and {len(keys) - MAX_KEYS} more" if len(keys) > MAX_KEYS else ""
        yield (
            f"  {count:>7} of the new were run before with another "
            f"{', '.join(keys[:MAX_KEYS])}{further}"
        )

    conditions = Counter(condition for condition, _ in planned.excluded)
    for condition, count in conditions.items():
        yield f"  {count:>7} excluded by {condition}"


def _needs(planned: "Plan") -> Iterator[str]:
    """Yield time and disk space that the new runs of a plan need."""
    from rich.filesize import decimal

    if planned.seconds is None and planned.basis:
        yield f"  {planned.basis}"
        return
    if planned.seconds is None or planned.bytes is None:
        if any(run.state in ("new", "lost") for run in planned.runs):
            yield "  time and size unknown: no recorded runs to tell from"
        else:
            yield "  nothing to do"
        return

    middle, low, high = _texts_of_seconds(planned.seconds, planned.workers)
    workers = "one worker" if planned.workers == 1 else f"{planned.workers} workers"
    yield f"  time: about {middle} with {workers} ({low} to {high})"

    middle, low, high = (decimal(round(count)) for count in planned.bytes)
    free = decimal(round(planned.free))
    yield f"  disk: about {middle} ({low} to {high}), {free} free"
    yield f"  from {planned.basis}"


def _texts_of_seconds(seconds: Sequence[float], workers: int) -> list[str]:
    """Return times that are shared between workers as people read them."""
    return [outcome.seconds_text(value / workers) for value in seconds]


def _update_plan_text(
    campaign: "Campaign", store: Store, workers: int | None
) -> output.Text:
    """Yield which runs `wearlab update` would need, and whether its answer is there."""
    from wearlab.runner.plan import WORDS, plan
    from wearlab.updating.cases import studies
    from wearlab.updating.identity import stored_update

    subjects = studies(campaign)
    is_stored = (
        store.path.exists()
        and stored_update(subjects, store, replay=False, check=0) is not None
    )
    if is_stored:
        yield "\nwearlab update: made before, it would be read"
        return

    yield "\nwearlab update needs"
    for group in _groups_of(subjects):
        scenes = {scene.id: scene for study in group for scene in study.scenes}
        runs = group[0].campaign(campaign.title, list(scenes.values()))
        planned = plan(runs, store, workers=workers)
        states = ", ".join(
            f"{planned.count(state)} {label}"
            for state, label in WORDS.items()
            if planned.count(state)
        )
        time = ""
        if planned.seconds is not None:
            time = f", about {planned.seconds.value / planned.workers:.2g} s"
        label = group[0].label if len(group) == 1 else f"{len(group)} units"
        yield f"  {label}: {len(planned.runs)} runs, {states}{time}"
    yield "  and as many longer ones where the measurements lie beyond them"


@app.command(
    "compile",
    help="Compile what the runs of FILEs will call, ahead of them: for an image, or "
    "before nodes begin.",
)
def compile_command(
    files: Annotated[list[str], options.argument("FILE...", "Campaign files (TOML).")],
    workers: options.Workers = None,
) -> None:
    """Compile the kernels that the runs of campaign files will call."""
    from wearlab.runner.local import compile_ahead

    campaigns = [output.read_campaign(file) for file in files]
    kinds, seconds = compile_ahead(campaigns, workers, progress=True)
    noun = "kind" if kinds == 1 else "kinds"
    output.say(f"compiled for {kinds} {noun} of scenes in {seconds:.1f} s")


@app.command()
def modes(
    file: options.CampaignFile,
    case: Annotated[
        str | None,
        options.option("--case", "Which case.", "LABEL", show_default="the first"),
    ] = None,
) -> output.Findings:
    """Show natural frequencies and critical speeds of FILE's gears."""
    scenes = scenes_by_label(output.read_campaign(file))
    label = next(iter(scenes)) if case is None else case
    if label not in scenes:
        raise output.Stop(f"--case {label}: there are {', '.join(scenes)}")

    from wearlab.simulation import modes_table

    with output.refusing(ValueError):
        rows: list[dict[str, Any]] = modes_table(scenes[label])
    if not rows:
        return output.Findings(rows, [])
    cells = [
        [
            f"{value:.5g}" if isinstance(value, float) else str(value)
            for value in row.values()
        ]
        for row in rows
    ]
    return output.Findings(rows, [output.ShownTable(list(rows[0]), cells)])
