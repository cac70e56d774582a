"""``check``, ``run``, ``modes``, ``schema``: what is done with a campaign."""

from typing import TYPE_CHECKING, Any

from wearlab.cli.output import (
    REFUSALS,
    Status,
    Stop,
    complain,
    load_campaign,
    load_plugins,
    refusing,
    say,
    show_json,
    show_table,
)
from wearlab.store.place import place, value_text

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case
    from wearlab.runner import Report
    from wearlab.store import Store

SHORT_ID = 10
MOST_VALUES = 20
"""Values of an axis that are listed one by one."""


def check_campaign(file: str, as_json: bool) -> Status:
    """Show what a campaign file asks for, and which of its cases cannot be."""
    from wearlab.scene import parts_left_out, parts_present

    campaign = sound_campaign(file)
    _refuse_the_impossible(campaign)
    parts = {
        label: (parts_present(case.scene), parts_left_out(case.scene))
        for label, case in _first_of_each_label(campaign).items()
    }
    refused = _impossible(campaign)
    status = Status.WELL if all(case["expected"] for case in refused) else Status.TROUBLE
    runs = len({case.id for case in campaign.cases})
    if as_json:
        show_json(
            {
                "title": campaign.title,
                "cases": len(campaign.cases),
                "runs": runs,
                "axes": [{"name": a.name, "values": list(a.values), "units": a.units} for a in campaign.axes],
                "parts": {label: {"present": p, "left_out": out} for label, (p, out) in parts.items()},
                "refused": refused,
                "warnings": list(campaign.warnings),
            }
        )
        return status
    say(campaign.title)
    for axis in campaign.axes:
        ends = axis.values if len(axis.values) <= MOST_VALUES else (*axis.values[:3], "…", axis.values[-1])
        values = ", ".join(value_text(value, None) for value in ends)
        count = "" if len(ends) == len(axis.values) else f" ({len(axis.values)} values)"
        say(f"  {axis.name}: {values} {axis.units or ''}".rstrip() + count)
    say(f"  {len(campaign.cases)} cases, {runs} runs")
    for label, (present, left_out) in parts.items():
        say(f"\n{label}")
        for part in present:
            say(f"  + {part}")
        say(f"  left out: {', '.join(left_out) or 'nothing'}")
    from wearlab.cli.updating import tell_update
    from wearlab.updating import UpdateError

    with refusing(UpdateError):
        tell_update(campaign)
    for warning in campaign.warnings:
        complain(f"\nwarning: {warning}")
    for case in refused:
        foreseen = ", as expected" if case["expected"] else ""
        complain(f"\nrefused{foreseen}: {case['case']}: {case['reason']}")
    return status


def sound_campaign(file: str) -> "Campaign":
    """Read a campaign file whose figures name kinds, variables, dimensions and cases that exist."""
    campaign = load_campaign(file)
    _refuse_wrong_figures(campaign, file)
    return campaign


def _refuse_wrong_figures(campaign: "Campaign", file: str) -> None:
    if campaign.figures:
        from wearlab.figures.checking import figure_problems

        problems = figure_problems(campaign)
        if problems:
            raise Stop("\n".join(f"{file}: {problem}" for problem in problems))


def _refuse_the_impossible(campaign: "Campaign") -> None:
    """Stop before anything is written when not one case can be, and none is expected to be refused."""
    refused = _impossible(campaign)
    if len(refused) == len({case.id for case in campaign.cases}) and not any(r["expected"] for r in refused):
        raise Stop("\n".join(f"{case['case']}: {case['reason']}" for case in refused))


def _first_of_each_label(campaign: "Campaign") -> dict[str, "Case"]:
    first: dict[str, Case] = {}
    for case in campaign.cases:
        first.setdefault(case.label, case)
    return first


def _impossible(campaign: "Campaign") -> list[dict[str, Any]]:
    """Return the cases whose gears, flanks or supports cannot be, why, and whether the file expects it."""
    from wearlab.gears.errors import GearError
    from wearlab.scene.build.contact import check_initial_wear
    from wearlab.scene.build.sets import build_set
    from wearlab.scene.build.system import check_held

    refused = []
    for case in {case.id: case for case in campaign.cases}.values():
        try:
            gears = build_set(case.scene)
            check_initial_wear(case.scene, gears)
            check_held(case.scene, gears)
        except GearError as error:
            expected = case.expect is not None and case.expect.verdict == "refused"
            impossible = {"case": case_name(campaign, case), "id": case.id, "reason": str(error)}
            refused.append({**impossible, "expected": expected})
    return refused


def case_name(campaign: "Campaign", case: "Case") -> str:
    """Return what a person calls a case: its label and its place on the axes."""
    words = ", ".join(f"{name}={value}" for name, value in place(campaign, case).items())
    return f"{case.label} ({words})" if words else case.label


def run_campaign(
    file: str,
    store: "Store",
    as_json: bool,
    workers: int | None,
    scheduler: str | None,
    retry: bool,
    recompute: str | None,
    dashboard: bool,
) -> Status:
    """Compute what is missing and report trouble."""
    from wearlab.plugins import PluginError
    from wearlab.runner import Interrupted, RunnerError, foresee, run

    campaign = load_campaign(file)
    with refusing(*REFUSALS):
        foresee(campaign, store, scheduler)
    _refuse_wrong_figures(campaign, file)
    _refuse_the_impossible(campaign)
    try:
        with refusing(*REFUSALS, RunnerError, PluginError):
            report = run(
                campaign,
                store,
                workers=workers,
                scheduler=scheduler,
                retry=retry,
                recompute=recompute,
                progress=not as_json,
                dashboard=dashboard,
            )
    except Interrupted as interrupted:
        raise Stop(str(interrupted), Status.INTERRUPTED) from None
    if as_json:
        show_json(report.to_dict())
    else:
        _tell(campaign, report)
    return Status.WELL if report.ok else Status.TROUBLE


def _tell(campaign: "Campaign", report: "Report") -> None:
    for note in report.notes:
        complain(note)
    say(report.headline)
    names: dict[str, str] = {case.id: case_name(campaign, case) for case in reversed(campaign.cases)}
    foreseen = {case.id for case in report.expected if case.comparison.met}
    for case in report.troubled:
        if case.state != "done" and case.id not in foreseen:
            complain(f"{case.state}: {names[case.id]}, run {case.id[:SHORT_ID]}: {case.headline}")
        for warning in case.warnings:
            complain(f"warning: {names[case.id]}, run {case.id[:SHORT_ID]}: {warning}")
    _tell_expected(report)


def _tell_expected(report: "Report") -> None:
    """Show case → verdict → expected → measured, where the campaign expects something."""
    if not report.expected:
        return
    rows = []
    for case in report.expected:
        place_words = ", ".join(f"{name}={value}" for name, value in case.position.items())
        verdict, expected, measured, met = case.comparison
        rows.append((case.label, place_words, verdict, expected, measured, "yes" if met else "NO"))
    say()
    show_table(("case", "differs by", "verdict", "expected", "measured", "met"), rows)
    missed = sum(not case.comparison.met for case in report.expected)
    say(f"{len(rows) - missed} of {len(rows)} as expected")


def show_modes(file: str, label: str | None, as_json: bool) -> Status:
    """Show natural frequencies and critical speeds of one case of a campaign."""
    campaign = load_campaign(file)
    cases = _first_of_each_label(campaign)
    if label is None:
        label = campaign.cases[0].label
    if label not in cases:
        raise Stop(f"--case {label}: there are {', '.join(cases)}")
    from wearlab.gears.errors import GearError
    from wearlab.simulation import modes_table

    with refusing(GearError, ValueError):
        rows: list[dict[str, Any]] = modes_table(cases[label].scene)
    if as_json:
        show_json(rows)
    elif rows:
        show_table(list(rows[0]), [[_cell(value) for value in row.values()] for row in rows])
    return Status.WELL


def _cell(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def show_schema(file: str | None, added: bool, figures: bool) -> Status:
    """Print the JSON Schema of campaign files, with or of a file's plug-ins, or the kinds of figures."""
    if figures:
        from wearlab.figures import KINDS

        show_json(sorted(KINDS))
        return Status.WELL
    from wearlab.campaign import added_json, schema_json

    if added and file is None:
        raise Stop("--added needs a campaign FILE that names plug-ins")
    plugins = () if file is None else load_plugins(file)
    say(added_json(plugins) if added else schema_json())
    return Status.WELL
