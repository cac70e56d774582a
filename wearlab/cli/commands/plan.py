"""Before a run: which campaigns and cases can be.

``check``, ``plan``, ``compile`` and ``modes``.
"""

from collections import Counter
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.cli import app, output
from wearlab.store import Store, outcome
from wearlab.units import convert

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.campaign.claims import Checked
    from wearlab.runner.plan import Plan
    from wearlab.updating.cases import Subjects


def refuse_the_impossible(campaign: "Campaign") -> list[dict[str, Any]]:
    """Return the cases whose gears, flanks or supports cannot be, why, and whether the file expects it.

    Raises
    ------
    Stop : not one case can be, and none is expected to be refused; nothing is written
        then
    """
    from wearlab.assembly import contact, sets, vibration
    from wearlab.gears.specification import GearError

    cases = {case.id: case for case in campaign.cases}
    refused: list[dict[str, Any]] = []
    reasons: dict[str, list[str]] = {}
    for case in cases.values():
        try:
            gears = sets.build_set(case.scene)
            contact.check_initial_wear(case.scene, gears)
            contact.check_limits(case.scene, gears)
            vibration.check_held(case.scene, gears)
        except GearError as error:
            name = output.case_name(campaign, case)
            reason = str(error)
            expected = case.expect is not None and case.expect.verdict == "refused"
            refused.append(
                {"case": name, "id": case.id, "reason": reason, "expected": expected}
            )
            reasons.setdefault(reason, []).append(name)
    if len(refused) == len(cases) and not any(case["expected"] for case in refused):
        told = (
            (one, f" and {len(more)} more" * bool(more), why)
            for why, (one, *more) in reasons.items()
        )
        raise output.Stop("\n".join(f"{one}{more}: {why}" for one, more, why in told))
    return refused


def scenes_by_label(campaign: "Campaign") -> dict[str, Any]:
    """Return the scene of the first case of every label."""
    scenes: dict[str, Any] = {}
    for case in campaign.cases:
        scenes.setdefault(case.label, case.scene)
    return scenes


@app.command()
def check(
    file: str, claims: bool = False, measured: Path | None = None, *, store: Store
) -> output.Findings:
    """Show what FILE asks for: parts, cases, and which of them cannot be.

    Or whether its claims hold.

    Parameters
    ----------
    claims : Hold what FILE says of its runs against those in the store.
    measured : JSON: With --claims: against what it wrote with --json, of equal runs,
        not the store.
    """
    if claims:
        return _claims(output.sound_campaign(file), measured or store)
    if measured:
        raise output.Stop("--measured holds claims: write --claims, too")
    from wearlab.scene import parts_left_out, parts_present

    campaign = output.sound_campaign(file)
    refused = refuse_the_impossible(campaign)
    scenes = scenes_by_label(campaign)
    built = _built(scenes)
    parts = {
        n: {"present": parts_present(s), "left_out": parts_left_out(s)}
        for n, s in scenes.items()
    }
    axes = [
        {"name": axis.name, "values": axis.values, "units": axis.units}
        for axis in campaign.axes
    ]
    content: dict[str, Any] = {"title": campaign.title, "cases": len(campaign.cases)}
    content |= {
        "runs": len({case.id for case in campaign.cases}),
        "axes": axes,
        "parts": parts,
    }
    content |= {
        "gears": {label: table.rows for label, table in built.items()},
        "refused": refused,
    }
    content |= {"warnings": campaign.warnings}
    well = all(one["expected"] for one in refused)
    return output.Findings(content, _asked_for(campaign, scenes, content, built), well)


def _asked_for(
    campaign: "Campaign",
    scenes: dict[str, Any],
    content: dict[str, Any],
    built: dict[str, output.ShownTable],
) -> output.Text:
    """Yield what a campaign asks for; what is wrong with it goes to standard error."""
    yield campaign.title
    for axis in campaign.axes:
        ends = (
            axis.values
            if len(axis.values) <= 20
            else (*axis.values[:3], "…", axis.values[-1])
        )
        values = ", ".join(outcome.value_text(value, None) for value in ends)
        count = "" if len(ends) == len(axis.values) else f" ({len(axis.values)} values)"
        yield f"  {axis.name}: {values} {axis.units or ''}".rstrip() + count
    yield f"  {content['cases']} cases, {content['runs']} runs"
    for label, parts in content["parts"].items():
        yield from (f"\n{label}", *(f"  + {part}" for part in parts["present"]))
        yield f"  left out: {', '.join(parts['left_out']) or 'nothing'}"
    for label, table in built.items():
        yield from (f"\ngears of {label}", table)
    for label, scene in scenes.items():
        yield from _duty(label, scene)
    if campaign.update is not None:
        yield from _update(campaign)
    for warning in campaign.warnings:
        output.complain(f"\nwarning: {warning}")
    for one in content["refused"]:
        foreseen = ", as expected" if one["expected"] else ""
        output.complain(f"\nrefused{foreseen}: {one['case']}: {one['reason']}")


def _duty(label: str, scene: Any) -> output.Text:
    """Yield the conditions that take turns, as they were read."""
    blocks = scene.operation.blocks
    table = scene.duty_table
    if not blocks:
        return
    yield f"\nload spectrum of {label}" + (
        "" if table is None else f", {table.file}: {table.understood}"
    )
    rows = []
    for b in blocks:
        numbers = (
            b.torque,
            convert(b.speed, "rad/s", "rpm"),
            100.0 * b.share,
            1e-3 * b.torque * b.speed,
        )
        rows.append([f"{number:.6g}" for number in numbers])
    mean = sum(block.share * block.torque * block.speed for block in blocks)
    rows.append(["mean", "", "100", f"{1e-3 * mean:.6g}"])
    yield output.ShownTable(
        ["torque [N·m]", "speed [rpm]", "share [%]", "power [kW]"], rows
    )


def _update(campaign: "Campaign") -> output.Text:
    """Yield what a campaign's [update] has to go by.

    Raises
    ------
    UpdateError : its data cannot be read, or it cannot be updated
    """
    from wearlab.schema import VARIABLES
    from wearlab.updating.cases import studies

    for some in _told_together(studies(campaign)):
        study = some[0]
        yield f"\nupdate of {study.label if len(some) == 1 else f'{len(some)} units'}"
        for key, prior in study.spec.unknown.items():
            cost = "" if key not in study.costly else f", {study.spec.draws} runs"
            before = f"{prior.at(0.05):.4g} to {prior.at(0.95):.4g} {prior.unit or ''}"
            yield f"  unknown: {key}, before {before}{cost}"
        for blocks in zip(*(one.observations for one in some), strict=True):
            data = blocks[0].data
            count = sum(map(len, blocks))
            each = ", ".join(
                f"{one.label} {len(seen)}"
                for one, seen in zip(some, blocks, strict=True)
            )
            said = (
                f"{count} values of {data.label.replace('_', ' ')} in {data.file.name}"
            )
            yield f"  measured: {said}{f': {each}' if len(some) > 1 else ''}"
        for limit in dict.fromkeys(one.limit for one in some):
            where = f" of the {limit.where}" if limit.where else ""
            unit = VARIABLES[limit.quantity]
            level = convert(limit.value, unit.units, unit.display_units)
            yield f"  limit: {unit.long_name}{where}, {level:.4g} {unit.display_units}"


def _told_together(wanted: "Subjects") -> "list[Subjects]":
    """Return what is said at once: the units of a fleet, and each case by itself."""
    return (
        [wanted] if wanted[0].spec.fleet is not None else [(study,) for study in wanted]
    )


def _claims(campaign: "Campaign", held_by: "Store | Path") -> output.Findings:
    """Return of every claim what runs say, and which numbers of notes they do not have."""
    from wearlab.campaign import claims

    if isinstance(held_by, Store):
        record = claims.measured(campaign, held_by.open(campaign))
        stale = ""
    else:
        with output.refusing(OSError, ValueError):
            record = claims.ClaimRecord.read(held_by.read_bytes(), str(held_by))
        stale = claims.stale(campaign, record)
    checked, lacking = claims.check_record(campaign, record, stale)
    told = {one.name: one.model_dump() for one in record.claims}
    rows = []
    for one in checked:
        came = {"measured": one.measured, "reason": one.reason, "holds": one.holds}
        rows.append(
            told.get(one.claim.name, {})
            | one.claim.model_dump(exclude_none=True)
            | came
        )
    held = {
        "title": campaign.title,
        **record.model_dump(),
        "claims": rows,
        "unfilled": lacking,
    }
    well = all(one.holds for one in checked) and not lacking
    return output.Findings(held, _held(campaign.title, checked, lacking), well)


def _held(title: str, checked: "list[Checked]", lacking: list[str]) -> output.Text:
    for one in checked:
        claim = one.claim
        said = (
            one.reason
            if one.measured is None
            else f"{one.measured:.4g} {claim.unit}".rstrip()
        )
        words = f"{claim.name}: {said}; claimed {claim.value} within {claim.tolerance}"
        if one.holds:
            yield f"holds  {words}"
        else:
            output.complain(f"fails  {words}")
    for line in lacking:
        output.complain(f"fails  {line}")
    yield f"{sum(one.holds for one in checked)} of {len(checked)} claims hold: {title}"


def _built(scenes: dict[str, Any]) -> dict[str, output.ShownTable]:
    """Return heads and rows of the gears as they were built, once for all labels that have the same."""
    from wearlab.assembly import sheet
    from wearlab.gears.specification import GearError

    built: dict[str, output.ShownTable] = {}
    for label, scene in scenes.items():
        with suppress(GearError):  # told as refused
            made = sheet.sheet(scene)
            blank = [""] * len(made.members)  # behind what all gears share
            rows = [
                (r.symbol, r.meaning, *[*r.values, *blank][: len(blank)], r.unit)
                for r in made.rows
            ]
            table = output.ShownTable(("", "", *made.members, "unit"), rows)
            if table not in built.values():
                built[label] = table
    return built


SHOWN = 6


@app.command()
def plan(
    file: str, store: Store, workers: int | None = None, retry: bool = False
) -> output.Findings:
    """Show what run would do with FILE: new, cached, excluded, failed before.

    Time and disk space.

    Parameters
    ----------
    retry : Count failed and refused cases too.
    """
    from wearlab.runner.plan import plan as planned_of

    campaign = output.read_campaign(file)
    planned = planned_of(campaign, store, workers=workers, retry=retry)
    further = (
        () if campaign.update is None else _for_the_update(campaign, store, workers)
    )
    warnings = [f"warning: {warning}" for warning in planned.warnings]
    text = chain(_planned(planned), further)
    return output.Findings(partial(_content, planned), text, not warnings, warnings)


def _content(planned: "Plan") -> dict[str, Any]:
    amounts = {"seconds": planned.seconds, "bytes": planned.bytes}
    content = asdict(planned) | {
        name: amount and amount._asdict() for name, amount in amounts.items()
    }
    return content | {"runs": [run._asdict() for run in planned.runs]}


def _planned(planned: "Plan") -> output.Text:
    from rich.filesize import decimal

    from wearlab.runner.plan import WORDS

    yield planned.title
    yield (
        f"  {planned.cases} cases, {len(planned.runs)} distinct runs, "
        f"{len(planned.excluded)} excluded"
    )
    for state, words in WORDS.items():
        if count := planned.count(state):
            yield f"  {count:>7} {words}"
    if other := sum(run.other_code for run in planned.runs):
        yield f"  {other:>7} of the cached made by other code"
    for keys, count in Counter(
        run.changed for run in planned.runs if run.changed
    ).items():
        others = f" and {len(keys) - SHOWN} more" if len(keys) > SHOWN else ""
        yield (
            f"  {count:>7} of the new were run before with another "
            f"{', '.join(keys[:SHOWN])}{others}"
        )
    for condition, count in Counter(
        condition for condition, _ in planned.excluded
    ).items():
        yield f"  {count:>7} excluded by {condition}"
    for run in planned.runs:
        if run.state in ("failed", "refused", "lost"):
            yield f"  {run.state}: {output.in_words(run.label, run.position)}"
    if planned.seconds is None and planned.basis:
        yield f"  {planned.basis}"
        return
    if planned.seconds is None or planned.bytes is None:
        to_do = any(run.state in ("new", "lost") for run in planned.runs)
        yield (
            "  time and size unknown: no recorded runs to tell from"
            if to_do
            else "  nothing to do"
        )
        return
    about, least, most = (
        outcome.seconds_text(value / planned.workers) for value in planned.seconds
    )
    workers = "one worker" if planned.workers == 1 else f"{planned.workers} workers"
    yield f"  time: about {about} with {workers} ({least} to {most})"
    size, low, high, free = (
        decimal(round(count)) for count in (*planned.bytes, planned.free)
    )
    yield f"  disk: about {size} ({low} to {high}), {free} free"
    yield f"  from {planned.basis}"


def _for_the_update(
    campaign: "Campaign", store: Store, workers: int | None
) -> output.Text:
    """Yield which runs `wearlab update` would need, and whether its answer is there already."""
    from wearlab.runner.plan import WORDS, plan
    from wearlab.updating.cases import studies
    from wearlab.updating.inference import stored_update

    wanted = studies(campaign)
    if (
        store.path.exists()
        and stored_update(wanted, store, replay=False, check=0) is not None
    ):
        yield "\nwearlab update: made before, it would be read"
        return
    yield "\nwearlab update needs"
    for some in _told_together(wanted):
        scenes = {scene.id: scene for study in some for scene in study.scenes}
        planned = plan(
            some[0].campaign(campaign.title, list(scenes.values())),
            store,
            workers=workers,
        )
        states = ", ".join(
            f"{planned.count(s)} {w}" for s, w in WORDS.items() if planned.count(s)
        )
        time = (
            ""
            if planned.seconds is None
            else f", about {planned.seconds.value / planned.workers:.2g} s"
        )
        label = some[0].label if len(some) == 1 else f"{len(some)} units"
        yield f"  {label}: {len(planned.runs)} runs, {states}{time}"
    yield "  and as many longer ones where the measurements lie beyond them"


@app.command("compile")
def compile_command(files: list[str], workers: int | None = None) -> None:
    """Compile what the runs of FILEs will call, ahead of them: for an image, or before nodes begin.

    Parameters
    ----------
    files : FILE...: Campaign files (TOML).
    """
    from wearlab.runner.local import compile_ahead

    kinds, seconds = compile_ahead(
        [output.read_campaign(file) for file in files], workers, progress=True
    )
    output.say(
        f"compiled for {kinds} {'kind' if kinds == 1 else 'kinds'} of scenes in "
        f"{seconds:.1f} s"
    )


@app.command()
def modes(file: str, case: str | None = None) -> output.Findings:
    """Show natural frequencies and critical speeds of FILE's gears.

    Parameters
    ----------
    case : LABEL [the first]: Which case.
    """
    scenes = scenes_by_label(output.read_campaign(file))
    case = next(iter(scenes)) if case is None else case
    if case not in scenes:
        raise output.Stop(f"--case {case}: there are {', '.join(scenes)}")
    from wearlab.simulation import modes_table

    with output.refusing(ValueError):
        rows: list[dict[str, Any]] = modes_table(scenes[case])
    cells = [
        [f"{v:.5g}" if isinstance(v, float) else str(v) for v in row.values()]
        for row in rows
    ]
    return output.Findings(
        rows, [output.ShownTable(list(rows[0]), cells)] if rows else []
    )
