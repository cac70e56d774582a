"""The runs that cases of a campaign were before their scene or the model changed."""

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from wearlab.store import outcome

if TYPE_CHECKING:
    from wearlab.store.archive import RunArchive


def former_runs(campaign: Any, archive: "RunArchive") -> dict[str, str]:
    """Return the run that each case of a campaign was when it was last recorded.

    Known by the file and the title of the campaign, label and place of the case.

    Parameters
    ----------
    campaign : its cases
    archive : of the store

    Returns
    -------
    ids of recorded runs by the ids that the cases have now; cases that were never
    recorded are left out
    """
    file = getattr(campaign, "path", None)
    path = None if file is None else str(file)
    latest: dict[str, str] = {}
    for member in archive.catalogue.members_of_campaign(campaign.title):
        if member.path == path:
            latest.setdefault(_place(member.label, member.position), member.run)

    former: dict[str, str] = {}
    for case in campaign.cases:
        place = _place(case.label, outcome.place(campaign, case))
        if place in latest:
            former.setdefault(case.id, latest[place])
    return former


def older_versions(
    campaign: Any, archive: "RunArchive", missing: Iterable[str]
) -> dict[str, str]:
    """Return what to say of missing runs that another version of the model made.

    Parameters
    ----------
    campaign : its cases
    archive : of the store
    missing : ids of runs that the store does not have

    Returns
    -------
    "of model version 5: run again", by the ids that have such a run
    """
    absent = set(missing)
    if not absent:
        return {}
    former = {
        run_id: before
        for run_id, before in former_runs(campaign, archive).items()
        if run_id in absent and before != run_id
    }
    entries = archive.entries(former.values())
    versions = {
        run_id: entries[before].summary.get("model_version")
        for run_id, before in former.items()
        if before in entries
    }
    return {
        run_id: f"of model version {version}: run again"
        for run_id, version in versions.items()
        if version is not None and not is_present(version)
    }


def is_present(version: Any) -> bool:
    """Say whether a version of the model is that of this wearlab.

    Parameters
    ----------
    version : as a run tells it, None: it does not
    """
    from wearlab.scene.identity import MODEL_VERSION  # managing runs needs no scenes

    return str(version) == str(MODEL_VERSION)


def _place(label: str, position: Mapping[str, Any]) -> str:
    """Return what tells the cases of a campaign apart, as text."""
    return json.dumps([label, position], sort_keys=True)
