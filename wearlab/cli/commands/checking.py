"""What a campaign file asks for."""

from wearlab.cli.options import File, Json
from wearlab.cli.output import Status, complain, refusing, say, show_json
from wearlab.cli.registry import app
from wearlab.cli.sound import first_of_each_label, impossible, refuse_the_impossible, sound_campaign
from wearlab.store.place import value_text

MOST_VALUES = 20
"""Values of an axis that are listed one by one."""


@app.command()
def check(file: File, json: Json = False) -> Status:
    """Show what FILE asks for: parts present and left out, cases, and which of them cannot be."""
    from wearlab.scene import parts_left_out, parts_present

    campaign = sound_campaign(file)
    refuse_the_impossible(campaign)
    parts = {
        label: (parts_present(case.scene), parts_left_out(case.scene))
        for label, case in first_of_each_label(campaign).items()
    }
    refused = impossible(campaign)
    status = Status.WELL if all(case["expected"] for case in refused) else Status.TROUBLE
    runs = len({case.id for case in campaign.cases})
    if json:
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
    from wearlab.cli.updates import tell_update
    from wearlab.updating import UpdateError

    with refusing(UpdateError):
        tell_update(campaign)
    for warning in campaign.warnings:
        complain(f"\nwarning: {warning}")
    for case in refused:
        foreseen = ", as expected" if case["expected"] else ""
        complain(f"\nrefused{foreseen}: {case['case']}: {case['reason']}")
    return status
