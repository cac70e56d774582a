"""What a campaign asks for and what came of it, entered into the catalogue."""

from typing import TYPE_CHECKING

from wearlab.runner import report
from wearlab.store import Store, catalogue, outcome

if TYPE_CHECKING:
    from wearlab.campaign import Campaign


def record(campaign: "Campaign", store: Store) -> str:
    """Enter the campaign's cases into the catalogue; return the campaign's key.

    Each case with the values that set it apart.

    Parameters
    ----------
    campaign : whose cases are entered
    store : whose catalogue it is
    """
    from wearlab.campaign import campaign as campaigns
    from wearlab.campaign.inheritance import source_text
    from wearlab.scene import MODEL_VERSION

    members = [
        (case.id, case.label, outcome.place(campaign, case)) for case in campaign.cases
    ]
    path = getattr(campaign, "path", None)
    text = source_text(path)
    return store.archive.catalogue.record_campaign(
        campaign.title,
        campaign.reference,
        None if path is None else str(path),
        members,
        getattr(campaign, "metadata", None),
        campaigns.with_figures(campaign),
        content=catalogue.key_of(f"{MODEL_VERSION} {text}") if text else "",
    )


def report_of(
    campaign: "Campaign",
    store: Store,
    campaign_key: str | None,
    computed: set[str],
    seconds: float,
    notes: tuple[str, ...],
) -> report.Report:
    """Return the state of all runs of the campaign.

    Parameters
    ----------
    campaign, store : whose runs, and where they are
    campaign_key : of the campaign in the catalogue; None of a store that may only be
        read, in which nothing is recorded
    computed : ids of the runs that this call computed
    seconds : that it took [s]
    notes : what else is to be known
    """
    heads = store.archive.heads(case.id for case in campaign.cases)
    labels = {case.id: case.label for case in reversed(campaign.cases)}
    troubled_ids = [
        head.id
        for head in heads.values()
        if head.state != "done" or (head.warnings and head.id in computed)
    ]
    troubled = tuple(
        report.CaseReport(
            entry.id, labels[entry.id], entry.state, entry.reason, entry.warnings
        )
        for entry in store.archive.entries(troubled_ids).values()
    )
    states = [head.state for head in heads.values()]
    return report.Report(
        total=len(labels),
        computed=len(computed & labels.keys()),
        done=states.count("done"),
        failed=states.count("failed"),
        refused=states.count("refused"),
        seconds=seconds,
        troubled=troubled,
        expected=_expected(campaign, store, campaign_key),
        notes=notes,
        campaign=campaign,
        store=store,
    )


def _expected(
    campaign: "Campaign", store: Store, campaign_key: str | None
) -> tuple[report.Expected, ...]:
    """Compare cases with what the campaign expects of them, and record it.

    Nothing is recorded without a key.
    """
    expectations = [getattr(case, "expect", None) for case in campaign.cases]
    expecting = zip(campaign.cases, expectations, strict=True)
    entries = store.archive.entries(
        case.id for case, expectation in expecting if expectation is not None
    )
    comparisons = [
        expectation and report.compare(expectation, case, store, entries.get(case.id))
        for case, expectation in zip(campaign.cases, expectations, strict=True)
    ]
    if campaign_key is not None:
        store.archive.catalogue.record_comparisons(campaign_key, comparisons)
    return tuple(
        report.Expected(case.id, case.label, outcome.place(campaign, case), comparison)
        for case, comparison in zip(campaign.cases, comparisons, strict=True)
        if comparison is not None
    )
