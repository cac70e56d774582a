"""The papers, figure by figure: ``python docs/papers_pages.py [STORE [CAMPAIGN ...]]``.

With a store every campaign that a paper names, or those given, is run there (what is stored is not computed again), its claims and the
numbers of its notes are read off the runs into ``docs/papers/measured.json``, and its figures are drawn, small, into
``docs/papers/images``; without one the pages are written anew from what is kept. The command fails when a claim or a number
of a note does. A test holds that the pages are up to date.
"""

import io
import json
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

TOP = Path(__file__).parents[1]
PAPERS = TOP / "docs" / "papers"
MEASURED = PAPERS / "measured.json"
BROAD, COLOURS = 900, 128
MANY = 3.0  # times as much is told as a factor
HEADS = ("in the paper", "quantity", "published", "as published here", "consistent here", "difference", "why")


def files() -> list[Path]:
    """Return the lists of figures and tables, one of each paper."""
    return sorted(PAPERS.glob("*.toml"))


def pages(measured: dict[str, Any]) -> dict[str, str]:
    """Return the page of every paper and the one that lists them, by their file's name."""
    made = {f"{file.stem}.md": page(tomllib.loads(file.read_text()), measured) for file in files()}
    rows = [f"- [{tomllib.loads(file.read_text())['title']}]({file.stem}.md)" for file in files()]
    toctree = "\n".join(["```{toctree}", ":hidden:", "", *(file.stem for file in files()), "```"])
    head = (
        "Every figure and table of the four papers, a row each: what is printed, what the choices of the paper give here, "
        "what consistent physics gives, and why they differ. Numbers are claims of the campaigns, which `wearlab check FILE "
        "--claims` holds against stored runs; `python docs/papers_pages.py STORE` computes everything anew. A parameter that "
        "was tuned until a curve fits is called tuned."
    )
    return {
        **made,
        "index.md": "\n\n".join(["# The papers, figure by figure", head, "\n".join(rows), toctree]) + "\n",
    }


def page(paper: dict[str, Any], measured: dict[str, Any]) -> str:
    """Return the page of one paper: a table of its figures, then the figures of its campaigns."""
    lines = ["| " + " | ".join(HEADS) + " |", "|" + "---|" * len(HEADS)]
    lines += [
        "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows(paper, measured)
    ]
    parts = [f"# {paper['title']}", f"{paper['reference']}. {paper['about']}", "\n".join(lines)]
    for name in names(paper):
        kept = measured.get(name, {})
        version = kept.get("model_version")
        parts += [f"## {kept.get('title', name)}"]
        parts += [f"`campaigns/{name}.toml`" + (f", runs of model version {version}" if version else "")]
        for drawn in kept.get("figures", []):
            parts.append(
                f"![{drawn['title']}](images/{drawn['file']})\n\n*{drawn['title']}.* {drawn['note']}".rstrip()
            )
    return "\n\n".join(parts) + "\n"


def names(paper: dict[str, Any]) -> list[str]:
    """Return the campaigns of a paper, those as published first."""
    return [*paper["as_published"], *paper["consistent"]]


def rows(paper: dict[str, Any], measured: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a paper: one for each claim about a figure, at least one for each figure."""
    claims = {name: measured.get(name, {}).get("claims", []) for name in names(paper)}
    for item in paper["item"]:
        about = f"{paper['short']} {item['name']}"
        own = {
            name: {one["name"]: one for one in some if (one.get("source") or "").split(",")[0] == about}
            for name, some in claims.items()
        }
        words = list(dict.fromkeys(word for some in own.values() for word in some))
        if not words or item.get("said"):
            text = [item.get(key, "") for key in ("published", "as_published", "consistent")]
            yield (item["name"], item["shows"], *text, "", item.get("why", ""))
        for word in words:
            yield _row(
                item,
                word,
                [[own[n].get(word) for n in paper[side]] for side in ("as_published", "consistent")],
            )


def _row(item: dict[str, Any], word: str, sides: Sequence[Sequence[Any]]) -> tuple[str, ...]:
    there = [[one for one in side if one] for side in sides]
    first = (there[0] or there[1])[0]
    printed = first.get("printed")
    told = ["; ".join(_number(one) for one in side) for side in there]
    apart = (
        "; ".join(dict.fromkeys(_apart(one) for one in (there[0] or there[1]))) if printed is not None else ""
    )
    why = "; ".join(dict.fromkeys(one["why"] for side in there for one in side if one.get("why")))
    text = "no number" if printed is None else str(printed)
    return (item["name"], word.replace("_", " "), text, *told, apart, why or item.get("why", ""))


def _number(claim: dict[str, Any]) -> str:
    if claim["measured"] is None:
        return "not computed"
    return f"{claim['measured']:.4g} {claim['unit']}".rstrip()


def _apart(claim: dict[str, Any]) -> str:
    """Return how far a number is from the printed one: in points of a value in %, as a factor when it is far, else relative."""
    measured, printed = claim["measured"], claim["source_number"]
    if measured is None:
        return ""
    if claim["place"]:
        return "the same" if measured == printed else "another"
    if claim["unit"] == "%":
        return f"{measured - printed:+.3g} points"
    if not printed or measured <= 0.0:
        return f"{measured - printed:+.3g} {claim['unit']}".rstrip()
    if not 1.0 / MANY < measured / printed < MANY:
        return f"{measured / printed:.3g} times"
    return f"{100.0 * (measured / printed - 1.0):+.2g} %"


def compute(store_folder: str, chosen: Sequence[str] = ()) -> tuple[dict[str, Any], int]:
    """Return title, claims and figures of every campaign of a paper, run, measured and drawn; and how much failed."""
    import wearlab as wl
    from wearlab.campaign.claims import check_claims, filled
    from wearlab.figures import FigureError, drawing
    from wearlab.figures.question import question
    from wearlab.scene.identity import MODEL_VERSION

    failed = 0
    kept = json.loads(MEASURED.read_text()) if MEASURED.exists() else {}
    store = wl.Store(store_folder)
    for name in dict.fromkeys(n for file in files() for n in names(tomllib.loads(file.read_text()))):
        if chosen and name not in chosen:
            continue
        campaign = wl.load(TOP / "campaigns" / f"{name}.toml")
        wl.run(campaign, store)
        grid = store.open(campaign)
        claims = []
        for one in check_claims(campaign.claims, grid):
            told = {
                key: getattr(one.claim, key)
                for key in ("name", "unit", "printed", "source", "why", "source_number")
            }
            told["place"] = "_at(" in one.claim.quantity
            value = None if one.measured is None else float(f"{one.measured:.5g}")
            claims.append({**told, "measured": value, "holds": one.holds})
            if not one.holds:
                failed += 1
                print(f"{name}: claim {one.claim.name} fails: {one.measured} {one.claim.unit} {one.reason}")
        figures = []
        for number, spec in enumerate(campaign.figures, 1):
            asked = question(campaign, spec, number)
            problems: list[str] = []
            note = filled(str(asked.table.get("note", "")), grid, problems)
            try:
                image, _ = drawing.answer(asked, grid, store, "png")
            except FigureError as error:
                failed += 1
                print(f"{name}: {error}")
                continue
            failed += len(problems)
            for problem in problems:
                print(f"{name}: figure {number}: {problem}")
            file = f"{name}-{asked.name}.png"
            small(image, PAPERS / "images" / file)
            figures.append({"title": spec.title or spec.kind, "note": note, "file": file})
        kept[name] = {
            "title": campaign.title,
            "model_version": MODEL_VERSION,
            "claims": claims,
            "figures": figures,
        }
        MEASURED.write_text(json.dumps(kept, indent=1, ensure_ascii=False, sort_keys=True) + "\n")
        print(
            f"{name}: {sum(one['holds'] for one in claims)} of {len(claims)} claims hold, {len(figures)} figures",
            flush=True,
        )
    return kept, failed


def small(image: bytes, file: Path) -> None:
    """Write a picture no broader than a page, in few colours."""
    from PIL import Image

    with Image.open(io.BytesIO(image)) as whole:
        width = min(BROAD, whole.width)
        small = whole.convert("RGB").resize(
            (width, round(whole.height * width / whole.width)), Image.Resampling.LANCZOS
        )
        file.parent.mkdir(exist_ok=True)
        small.quantize(COLOURS).save(file, optimize=True)


def write(folder: Path, measured: dict[str, Any]) -> None:
    """Write the pages."""
    for name, text in pages(measured).items():
        (folder / name).write_text(text)


if __name__ == "__main__":
    found, wrong = (
        compute(sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else (json.loads(MEASURED.read_text()), 0)
    )
    write(PAPERS, found)
    sys.exit(f"{wrong} claims, notes or figures failed" if wrong else 0)
