"""The papers, figure by figure: ``python docs/papers_pages.py [STORE [CAMPAIGN ...]]``.

With a store every campaign that a paper names, or those given, is run there (what is
stored is not computed again), what the runs say of its claims and of the numbers in its
notes is written to ``docs/papers/measured``, and its figures are drawn, small, into
``docs/papers/images``; without one the pages are written anew from what is kept. The
command fails when a claim or a number of a note does. A test holds that the pages are
up to date, and `wearlab check FILE --claims --measured` that what is kept is of the
campaigns as they are. ``--quick`` prints the files of the campaigns whose runs take
seconds.
"""

import json
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pictures

import wearlab as wl
from wearlab.campaign import claims as claiming
from wearlab.campaign import statements
from wearlab.figures import FigureError, drawing
from wearlab.figures.question import question
from wearlab.scene.identity import MODEL_VERSION

TOP = Path(__file__).parents[1]
PAPERS = TOP / "docs" / "papers"
MEASURED = PAPERS / "measured"
QUICK = 18.0  # seconds of all runs of a campaign
MANY = 3.0  # times as much is told as a factor
HEADS = (
    "in the paper",
    "quantity",
    "published",
    "as published here",
    "consistent here",
    "difference",
    "why",
)


class Kept(NamedTuple):
    """A campaign of a paper and what is kept of its runs.

    Parameters
    ----------
    campaign : as its file has it
    record : what the runs said
    version : of the model, None before they were run
    seconds : that they took in all
    """

    campaign: Any
    record: claiming.ClaimRecord
    version: int | None
    seconds: float

    @property
    def claims(self) -> dict[str, claiming.Checked]:
        """Every claim with its number, by name."""
        return {
            one.claim.name: one
            for one in claiming.check_record(self.campaign, self.record)[0]
        }


def kept(name: str) -> Kept:
    """Return a campaign with what is kept of its runs."""
    campaign = wl.load(TOP / "campaigns" / f"{name}.toml")
    file = MEASURED / f"{name}.json"
    if not file.exists():
        return Kept(
            campaign, claiming.ClaimRecord(runs=(), claims=(), numbers={}), None, 0.0
        )
    text = file.read_text()
    told = json.loads(text)
    return Kept(
        campaign,
        claiming.ClaimRecord.read(text, str(file)),
        told["model_version"],
        told["seconds"],
    )


def files() -> list[Path]:
    """Return the lists of figures and tables, one of each paper."""
    return sorted(PAPERS.glob("*.toml"))


def all_kept() -> dict[str, Kept]:
    """Return every campaign that a paper names."""
    return {
        name: kept(name)
        for file in files()
        for name in names(tomllib.loads(file.read_text()))
    }


def pages(measured: dict[str, Kept]) -> dict[str, str]:
    """Return the page of every paper and the one that lists them, by their file's name."""
    made = {
        f"{file.stem}.md": page(tomllib.loads(file.read_text()), measured)
        for file in files()
    }
    rows = [
        f"- [{tomllib.loads(file.read_text())['title']}]({file.stem}.md)"
        for file in files()
    ]
    toctree = "\n".join(
        ["```{toctree}", ":hidden:", "", *(file.stem for file in files()), "```"]
    )
    head = (
        "Every figure and table of the four papers, a row each: what is printed, what "
        "the choices of the paper give here, "
        "what consistent physics gives, and why they differ. Numbers are claims of "
        "the campaigns, which `wearlab check FILE "
        "--claims` holds against stored runs; `python docs/papers_pages.py STORE` "
        "computes everything anew. A parameter that "
        "was tuned until a curve fits is called tuned."
    )
    return {
        **made,
        "index.md": "\n\n".join(
            ["# The papers, figure by figure", head, "\n".join(rows), toctree]
        )
        + "\n",
    }


def page(paper: dict[str, Any], measured: dict[str, Kept]) -> str:
    """Return the page of one paper: a table of its figures, then the figures of its campaigns."""
    lines = ["| " + " | ".join(HEADS) + " |", "|" + "---|" * len(HEADS)]
    lines += [
        "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
        for row in rows(paper, measured)
    ]
    parts = [
        f"# {paper['title']}",
        f"{paper['reference']}. {paper['about']}",
        "\n".join(lines),
    ]
    for name in names(paper):
        campaign, record, version, _ = measured[name]
        parts += [f"## {campaign.title}"]
        parts += [
            f"`campaigns/{name}.toml`"
            + (f", runs of model version {version}" if version else "")
        ]
        for number, spec in enumerate(campaign.figures, 1):
            title = spec.title or spec.kind
            note = claiming.refilled(
                claiming.spelled_note(spec.note or "", campaign.claims), record.numbers
            )
            image = f"images/{name}-{question(campaign, spec, number).name}.png"
            parts.append(f"![{title}]({image})\n\n*{title}.* {note}".rstrip())
    return "\n\n".join(parts) + "\n"


def names(paper: dict[str, Any]) -> list[str]:
    """Return the campaigns of a paper, those as published first."""
    return [*paper["as_published"], *paper["consistent"]]


def rows(paper: dict[str, Any], measured: dict[str, Kept]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a paper: one for each claim about a figure, at least one for each figure."""
    claims = {name: measured[name].claims for name in names(paper)}
    for item in paper["item"]:
        about = f"{paper['short']} {item['name']}"
        own = {
            name: {
                word: one
                for word, one in some.items()
                if (one.claim.source or "").split(",")[0] == about
            }
            for name, some in claims.items()
        }
        words = list(dict.fromkeys(word for some in own.values() for word in some))
        if not words or item.get("said"):
            text = [
                item.get(key, "") for key in ("published", "as_published", "consistent")
            ]
            yield (item["name"], item["shows"], *text, "", item.get("why", ""))
        for word in words:
            yield _row(
                item,
                word,
                [
                    [own[n].get(word) for n in paper[side]]
                    for side in ("as_published", "consistent")
                ],
            )


def _row(
    item: dict[str, Any], word: str, sides: Sequence[Sequence[claiming.Checked | None]]
) -> tuple[str, ...]:
    there = [[one for one in side if one] for side in sides]
    printed = (there[0] or there[1])[0].claim.printed
    told = ["; ".join(_number(one) for one in side) for side in there]
    apart = (
        "; ".join(dict.fromkeys(_apart(one) for one in (there[0] or there[1])))
        if printed is not None
        else ""
    )
    why = "; ".join(
        dict.fromkeys(one.claim.why for side in there for one in side if one.claim.why)
    )
    text = "no number" if printed is None else str(printed)
    return (
        item["name"],
        word.replace("_", " "),
        text,
        *told,
        apart,
        why or item.get("why", ""),
    )


def _number(one: claiming.Checked) -> str:
    if one.measured is None:
        return "not computed"
    return f"{one.measured:.4g} {one.claim.unit}".rstrip()


def _apart(one: claiming.Checked) -> str:
    """Return how far a number is from the printed one: in points of a value in %, as a factor when it is far, else relative."""
    measured = one.measured
    printed = one.claim.source_number
    if measured is None:
        return ""
    if "_at(" in one.claim.quantity:
        return "the same" if measured == printed else "another"
    if one.claim.unit == "%":
        return f"{measured - printed:+.3g} points"
    if not printed or measured <= 0.0:
        return f"{measured - printed:+.3g} {one.claim.unit}".rstrip()
    if not 1.0 / MANY < measured / printed < MANY:
        return f"{measured / printed:.3g} times"
    return f"{100.0 * (measured / printed - 1.0):+.2g} %"


def compute(store_folder: str, chosen: Sequence[str] = ()) -> int:
    """Run, measure and draw every campaign of a paper, or those given.

    Return how much failed.
    """
    failed = 0
    store = wl.Store(store_folder)
    for name in dict.fromkeys(
        n for file in files() for n in names(tomllib.loads(file.read_text()))
    ):
        if chosen and name not in chosen:
            continue
        campaign = wl.load(TOP / "campaigns" / f"{name}.toml")
        wl.run(campaign, store)
        grid = store.open(campaign)
        record = claiming.measure(campaign, grid)
        checked, lacking = claiming.check_record(
            campaign, record, claiming.stale(campaign, record)
        )
        problems = [
            f"claim {one.claim.name}: {one.measured} {one.reason}"
            for one in checked
            if not one.holds
        ]
        problems += lacking
        problems += statements.problems(campaign, record)
        for number, spec in enumerate(campaign.figures, 1):
            asked = question(campaign, spec, number)
            try:
                image, _ = drawing.file_of(asked, grid, store, "png")
                pictures.write_small(
                    image, PAPERS / "images" / f"{name}-{asked.name}.png"
                )
            except FigureError as error:
                problems.append(str(error))
        keep(name, record, grid)
        failed += len(problems)
        print(
            f"{name}: {sum(one.holds for one in checked)} of {len(checked)} claims "
            "hold",
            flush=True,
        )
        for problem in problems:
            print(f"{name}: {problem}", flush=True)
    return failed


def keep(name: str, record: claiming.ClaimRecord, grid: Any) -> None:
    """Write what runs said, to five digits, and how long they took."""
    of_run = dict(
        zip(
            *(
                np.broadcast_arrays(grid.run_id, grid.run_time_total)[i].ravel()
                for i in (0, 1)
            ),
            strict=True,
        )
    )
    claims = [one.model_dump(exclude_defaults=True) for one in record.claims]
    for one in claims:
        one["measured"] = (
            None if one["measured"] is None else float(f"{one['measured']:.5g}")
        )
    told = {
        "model_version": MODEL_VERSION,
        "seconds": round(float(sum(of_run.values())), 1),
        **record.model_dump(exclude_defaults=True),
        "claims": claims,
    }
    MEASURED.mkdir(exist_ok=True)
    (MEASURED / f"{name}.json").write_text(
        json.dumps(told, indent=1, ensure_ascii=False) + "\n"
    )


def quick(measured: dict[str, Kept]) -> list[str]:
    """Return the files of the campaigns all of whose runs took seconds, and that claim something."""
    return [
        f"campaigns/{name}.toml"
        for name, one in measured.items()
        if one.seconds < QUICK and one.campaign.claims
    ]


def write(folder: Path, measured: dict[str, Kept]) -> None:
    """Write the pages."""
    for name, text in pages(measured).items():
        (folder / name).write_text(text)


if __name__ == "__main__":
    if sys.argv[1:] == ["--quick"]:
        print("\n".join(quick(all_kept())))
        sys.exit()
    if sys.argv[1:2] and sys.argv[1].startswith("-"):
        sys.exit(f"{__doc__}\nno option {sys.argv[1]}")
    wrong = compute(sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else 0
    write(PAPERS, all_kept())
    sys.exit(f"{wrong} claims, notes or figures failed" if wrong else 0)
