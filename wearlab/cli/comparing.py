"""``compare``: two runs or two campaigns, as a table, a dataset and a figure."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.cli.output import REFUSALS, Status, Stop, load_campaign, refusing, say, show_json, show_table

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import Store

ENDINGS = ("png", "svg", "pdf")


def compare_two(
    sides: tuple[str, str],
    store: "Store",
    on: str,
    tolerance: float,
    files: tuple[Path | None, Path | None],
    as_json: bool,
) -> Status:
    """Compare two runs or two campaigns.

    Parameters
    ----------
    sides : campaign files, ids of runs, or conditions that one run meets
    store : where their runs are
    on : cycle or wear_depth
    tolerance : relative
    files : of the dataset and of the figure, None for none
    as_json : print for machines
    """
    from wearlab.comparison import CompareError, compare

    if files[1] is not None and _ending(files[1]) not in ENDINGS:
        raise Stop(f"--figure {files[1]}: a figure ends in .png, .svg or .pdf")
    with refusing(*REFUSALS, CompareError):
        left, right = (_meant(side, store) for side in sides)
        comparison = compare(left, right, on=on, tolerance=tolerance, store=store)  # type: ignore[arg-type]
    written = _write(comparison, *files)
    if as_json:
        show_json(_content(comparison, written))
    else:
        _tell(comparison, written)
    return Status.WELL


def _ending(figure: Path) -> str:
    return figure.suffix.lower().removeprefix(".")


def _meant(word: str, store: "Store") -> Any:
    """Return the campaign of a file, or else the full id of a run."""
    if Path(word).is_file() or word.endswith(".toml"):
        return load_campaign(word)
    return store.find(word).id


def _write(comparison: "xr.Dataset", data: Path | None, figure: Path | None) -> list[str]:
    from wearlab.report.comparison import comparison_figure
    from wearlab.store.files import write_whole
    from wearlab.store.image import to_image

    written = []
    with refusing(*REFUSALS, OSError):
        if data is not None:
            write_whole(data, to_image(comparison)[0])
            written.append(str(data))
        if figure is not None:
            write_whole(figure, comparison_figure(comparison, _ending(figure)))
            written.append(str(figure))
    return written


def _tell(comparison: "xr.Dataset", written: list[str]) -> None:
    from wearlab.comparison.table import (
        PAIR_HEADS,
        QUANTITY_HEADS,
        SCENE_HEADS,
        pair_rows,
        quantity_rows,
        scene_rows,
    )

    campaigns = "pair" in comparison.dims
    names = (comparison.attrs["campaign_a"], comparison.attrs["campaign_b"]) if campaigns else (
        comparison.attrs["run_a"], comparison.attrs["run_b"])  # fmt: skip
    say(f"A  {names[0]}\nB  {names[1]}\n")
    rows = scene_rows(comparison)
    if rows:
        title = "Asked differently, in every pair" if campaigns else "Asked differently"
        show_table(SCENE_HEADS, rows, title=title)
    else:
        say("No key of the scenes differs" + (" in every pair" if campaigns else ""))
    say()
    along = comparison.attrs["aligned_on"].replace("_", " ")
    title = f"At the same {along}, tolerance {comparison.attrs['tolerance']:g}"
    if campaigns:
        show_table(PAIR_HEADS, pair_rows(comparison), title=title)
        for side in ("a", "b"):
            left = _list(comparison, f"only_{side}")
            if left:
                say(f"\nonly in {side.upper()}: {'; '.join(left)}")
    else:
        show_table(QUANTITY_HEADS, quantity_rows(comparison), title=title)
        _tell_first(comparison)
    for path in written:
        say(path)


def _tell_first(comparison: "xr.Dataset") -> None:
    import numpy as np

    from wearlab.comparison.table import QUANTITY_HEADS, quantity_rows

    first = comparison["first_difference"].values
    if not np.isfinite(first).any():
        say("\nNowhere do they differ by more than the tolerance.")
        return
    row = quantity_rows(comparison)[int(np.nanargmin(first))]
    where = row[QUANTITY_HEADS.index("first above tolerance")]
    say(f"\nThey first differ by more than the tolerance at {where}: {row[0]}.")


def _content(comparison: "xr.Dataset", written: list[str]) -> dict[str, Any]:
    import json

    from wearlab.store.image import plain

    attributes = {
        key: value for key, value in comparison.attrs.items() if not key.startswith(("only_", "scene_"))
    }
    content: dict[str, Any] = {
        **attributes,
        "scene_differences": json.loads(comparison.attrs["scene_differences"]),
        "quantities": comparison["quantity"].values.tolist(),
        "largest_relative_difference": plain(comparison["largest_relative_difference"].values),
        "first_difference": plain(comparison["first_difference"].values),
    }
    for name in ("life", "service_life", "relative_difference", "largest_value"):
        if name in comparison:
            content[name] = plain(comparison[name].values)
    if "pair" in comparison.dims:
        content["pairs"] = [
            {"name": str(name), "runs": comparison["run_id"].values[i].tolist()}
            for i, name in enumerate(comparison["pair"].values)
        ]
        content |= {side: _list(comparison, side) for side in ("only_a", "only_b")}
    return {**content, "files": written}


def _list(comparison: "xr.Dataset", name: str) -> list[str]:
    import json

    texts: list[str] = json.loads(comparison.attrs.get(name, "[]"))
    return texts
