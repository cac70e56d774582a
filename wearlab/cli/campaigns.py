"""Campaigns as commands take them: whose figures can be drawn, of which some case can be."""

from typing import TYPE_CHECKING, Any

from wearlab.cli import output
from wearlab.store.outcome import place

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case


def sound_campaign(file: str) -> "Campaign":
    """Read a campaign file whose figures name kinds, variables, dimensions and cases that exist."""
    campaign = output.read_campaign(file)
    refuse_wrong_figures(campaign, file)
    return campaign


def refuse_wrong_figures(campaign: "Campaign", file: str) -> None:
    """Stop where a figure names what does not exist."""
    if campaign.figures:
        from wearlab.figures.question import figure_problems

        problems = figure_problems(campaign)
        if problems:
            raise output.Stop("\n".join(f"{file}: {problem}" for problem in problems))


def refuse_the_impossible(campaign: "Campaign") -> None:
    """Stop before anything is written when not one case can be, and none is expected to be refused."""
    refused = impossible(campaign)
    if len(refused) == len({case.id for case in campaign.cases}) and not any(r["expected"] for r in refused):
        of_reason: dict[str, list[str]] = {}
        for case in refused:
            of_reason.setdefault(case["reason"], []).append(case["case"])
        raise output.Stop(
            "\n".join(
                f"{cases[0]}{f' and {len(cases) - 1} more' if cases[1:] else ''}: {reason}"
                for reason, cases in of_reason.items()
            )
        )


def first_of_each_label(campaign: "Campaign") -> dict[str, "Case"]:
    """Return the first case of every label."""
    first: dict[str, Case] = {}
    for case in campaign.cases:
        first.setdefault(case.label, case)
    return first


def impossible(campaign: "Campaign") -> list[dict[str, Any]]:
    """Return the cases whose gears, flanks or supports cannot be, why, and whether the file expects it."""
    from wearlab.gears.specification import GearError
    from wearlab.scene.build import contact, sets, vibration

    refused = []
    for case in {case.id: case for case in campaign.cases}.values():
        try:
            gears = sets.build_set(case.scene)
            contact.check_initial_wear(case.scene, gears)
            contact.check_limits(case.scene, gears)
            vibration.check_held(case.scene, gears)
        except GearError as error:
            expected = case.expect is not None and case.expect.verdict == "refused"
            impossible = {"case": case_name(campaign, case), "id": case.id, "reason": str(error)}
            refused.append({**impossible, "expected": expected})
    return refused


def case_name(campaign: "Campaign", case: "Case") -> str:
    """Return what a person calls a case: its label and its place on the axes."""
    words = ", ".join(f"{name}={value}" for name, value in place(campaign, case).items())
    return f"{case.label} ({words})" if words else case.label
