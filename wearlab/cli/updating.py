"""``update``: what measurements say, in words or as JSON."""

from typing import TYPE_CHECKING, Any

from wearlab.cli.output import REFUSALS, Status, load_campaign, refusing, say, show_json

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import Store


def update_campaign(
    file: str, store: "Store", replay: bool, check: int, workers: int | None, as_json: bool
) -> Status:
    """Update a campaign by its measurements and tell what came out."""
    from wearlab.updating import UpdateError, update
    from wearlab.updating.words import told

    campaign = load_campaign(file)
    with refusing(*REFUSALS, UpdateError):
        tree = update(campaign, store, replay=replay, check=check, progress=not as_json, workers=workers)
    if as_json:
        show_json(_content(tree))
    else:
        for line in told(tree):
            say(line)
        say(f"\nkept as update {str(tree.attrs['id'])[:10]}")
    return Status.WELL


def _content(tree: "xr.DataTree") -> dict[str, Any]:
    from wearlab.store.image import plain

    names = ("predictions", "sample_stats", "calibration")
    found: dict[str, Any] = {"id": tree.attrs["id"], "title": tree.attrs["title"]}
    for name in names:
        if name in tree.children:
            data = tree[name].to_dataset()
            found[name] = {str(key): plain(value.values) for key, value in data.variables.items()}
    return found
