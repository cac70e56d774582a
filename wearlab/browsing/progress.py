"""What is being computed now, by whatever process: how far lives and campaigns are."""

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from wearlab.browsing import recorded
from wearlab.store import outcome
from wearlab.store.lineage import name_of

if TYPE_CHECKING:
    from wearlab.store import Store


def progress(store: "Store") -> dict[str, Any]:
    """Return the runs under way, how far their lives are, and how far their campaigns are."""
    campaigns = _under_way(store)  # first: a run that begins meanwhile is then told, and not missed
    rows = store.catalogue.read(
        "SELECT id, owner, started FROM runs WHERE state = 'running' ORDER BY started"
    )
    present = datetime.now(UTC)
    told = []
    for run_id, owner, started in rows:
        reached = store.checkpoints.reached(run_id) if store.files.is_name(str(run_id)) else None
        told.append(
            {
                "id": str(run_id),
                "name": name_of(store, run_id) or str(run_id)[:10],
                "alive": store.is_alive(str(owner or "")),
                "since": _since(started, present),
                "cycles": "" if reached is None else f"{reached.cycle:.4g}",
                "depth": "" if reached is None else f"{1e6 * reached.depth:.3g} µm",
            }
        )
    return {"under_way": told, "campaigns": campaigns, "now": present.isoformat()}


def _since(started: Any, present: datetime) -> str:
    try:
        return outcome.seconds_text((present - datetime.fromisoformat(str(started))).total_seconds())
    except (ValueError, TypeError):
        return ""


def _under_way(store: "Store") -> list[dict[str, Any]]:
    """Return the campaigns with runs under way: finished, in all, time left by those finished."""
    told = []
    for each in recorded.campaigns(store)[0]:
        left = each.counts.get("running", 0)
        if not left:
            continue
        done = sum(each.counts.get(state, 0) for state in ("done", "failed", "refused"))
        total = done + left + each.counts.get("interrupted", 0) + each.counts.get("missing", 0)
        ((mean,),) = store.catalogue.read(
            "SELECT avg(r.seconds) FROM runs AS r JOIN members AS m ON m.run = r.id "
            "WHERE m.campaign = ? AND r.state = 'done'",
            [each.key],
        )
        time = "" if mean is None else outcome.seconds_text(float(mean) * (total - done) / left)
        told.append({"title": each.title, "done": done, "total": total, "left": left, "time": time})
    return told
