"""Stiff and extreme cases, what became of each: ``python docs/extremes_pages.py [NAME ...]``.

Runs the campaigns of ``campaigns/extremes`` that are named, all with ``all``, one case
after another in this process; keeps what each case came to and its processor time in
``docs/evidence/extremes.json``, and writes ``docs/evidence/extremes.md`` of all that is
kept, also without a name. What is extreme and how a case is judged stands in
``docs/evidence/extremes.toml``. ``--cases NAME LABEL ...`` runs some cases of a campaign.
"""

import json
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from numba.core import event

import wearlab
from wearlab.campaign import Campaign, load
from wearlab.scene.identity import MODEL_VERSION
from wearlab.store import Store

TOP = Path(__file__).parents[1]
CAMPAIGNS = TOP / "campaigns" / "extremes"
EVIDENCE = TOP / "docs" / "evidence"
MEASURED = EVIDENCE / "extremes.json"
TEXTS = EVIDENCE / "extremes.toml"
PAGE = EVIDENCE / "extremes.md"
LONG = 5.0
"""A case that takes less is run twice, and the shorter time counts: the first time
modules are imported and compiled code is read [s]."""
HEAD = """# Stiff and extreme cases

Every scene of `campaigns/extremes` is at an edge of what a gear can be or a solver can bear. Its file says what it is to come
to; the run must say the same, also when that is a refusal. `tests/test_extremes.py` runs all of them, and
`wearlab run campaigns/extremes/backlash.toml` runs one file. `python docs/extremes_pages.py all` makes this page.

Times are those of one core for the whole run, with its estimates of errors and its search for other attractors; compilation is left
out. A value that is expected with 0 is a residual: what of a balance does not close. What the verdicts mean:

- *completed*: one attracting response, or a life that reaches its limit.
- *coexisting*: other responses attract as well; *non-unique*: a family of responses, none of which attracts alone.
- *aperiodic*: no motion repeats; loads are averages over it, with their scatter.
- *not attracting within the margin*: the orbit exists, and nothing is drawn to it.
- *stopped*: the life ended early, for the reason given; *refused*: such gears cannot be, or cannot run."""


class CompileTime(event.Listener):
    """Processor time that numba spends compiling [s]: the outermost compilations count."""

    def __init__(self) -> None:
        self.depth = 0
        self.begun = 0.0
        self.seconds = 0.0

    def on_start(self, event: Any) -> None:
        """Begin a compilation, perhaps within another."""
        if self.depth == 0:
            self.begun = time.process_time()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        """End a compilation."""
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.process_time() - self.begun


@contextmanager
def compile_time() -> Iterator[CompileTime]:
    """Watch how long numba compiles within a block."""
    listener = CompileTime()
    with event.install_listener("numba:compile", listener):
        yield listener


def measure(name: str, labels: Sequence[str] = ()) -> None:
    """Run one campaign, case by case, and keep what became of its cases.

    Parameters
    ----------
    name : of the campaign
    labels : of the cases that are run, the others stay as they are; none: all
    """
    campaign = load(CAMPAIGNS / f"{name}.toml")
    before = kept().get(name, {}).get("cases", []) if labels else []

    cases = [case for case in before if case["label"] not in labels]
    for case in campaign.cases:
        if labels and case.label not in labels:
            continue
        alone = replace(campaign, cases=(case,))
        first = run_case(alone)
        again = first if first["seconds"] > LONG else run_case(alone)
        cases.append(min(first, again, key=lambda measured: measured["seconds"]))

    order = [case.label for case in campaign.cases]
    cases.sort(key=lambda case: order.index(case["label"]))
    measured = {
        "date": datetime.now(UTC).date().isoformat(),
        "model_version": MODEL_VERSION,
        "cases": cases,
    }
    everything = kept() | {name: measured}
    text = json.dumps(everything, indent=1, sort_keys=True, ensure_ascii=False)
    MEASURED.write_text(text + "\n")


def run_case(campaign: Campaign) -> dict[str, Any]:
    """Run a campaign of one case, and return what became of it."""
    with tempfile.TemporaryDirectory() as folder, compile_time() as compiling:
        store = Store(Path(folder) / "store")
        begun = time.process_time()
        report = wearlab.run(campaign, store, workers=0, progress=False)
        seconds = time.process_time() - begun - compiling.seconds
        store.close()

    (expected,) = report.expected
    return {
        "label": expected.label,
        "position": expected.position,
        "expected": expected.comparison.expected,
        "found": expected.comparison.measured,
        "met": expected.comparison.met,
        "reason": report.troubled[0].headline if report.troubled else "",
        "seconds": float(f"{seconds:.2g}"),
    }


def page() -> str:
    """Return the page of all that is kept."""
    texts = tomllib.loads(TEXTS.read_text())
    everything = kept()
    names = [name for name in campaigns() if name in everything]
    cases = [case for name in names for case in everything[name]["cases"]]
    met = sum(case["met"] for case in cases)
    refused = sum(case["found"] == "refused" for case in cases)

    absent = [f"`{name}`" for name in campaigns() if name not in everything]
    parts = [
        HEAD,
        f"{len(cases)} cases: {met} end as expected, {refused} of them are refused. "
        f"Together they take {sum(case['seconds'] for case in cases) / 60.0:.1f} "
        "minutes of one core.",
        *([f"Not run yet: {', '.join(absent)}."] if absent else []),
        overview(everything, texts),
    ]
    for name in names:
        parts += section(name, everything[name], texts[name])
    return "\n\n".join(parts) + "\n"


def overview(everything: dict[str, Any], texts: dict[str, Any]) -> str:
    """Return a table of the campaigns."""
    rows = []
    for name, measured in sorted(everything.items()):
        cases = measured["cases"]
        met = sum(case["met"] for case in cases)
        rows.append(
            (
                f"[{title(name)}](#{anchor(title(name))})",
                texts[name]["extreme"],
                f"{met} of {len(cases)}",
                seconds_text(sum(case["seconds"] for case in cases)),
            )
        )
    return table(("campaign", "what is extreme", "as expected", "time"), rows)


def section(
    name: str, measured: dict[str, Any], words: dict[str, Any]
) -> Iterator[str]:
    """Yield the parts of the page about one campaign."""
    yield f"## {title(name)}"
    yield (
        f"{words['extreme']}\n**Judged by.** {words['judged']}\n"
        f"`campaigns/extremes/{name}.toml`, run on {measured['date']}, model version "
        f"{measured['model_version']}."
    )
    rows = [
        (
            case_text(case, words.get("cases", {})),
            one_a_line(case["expected"]),
            found_text(case),
            seconds_text(case["seconds"]),
        )
        for case in measured["cases"]
    ]
    yield table(("case", "expected", "found", "time"), rows)


def case_text(case: dict[str, Any], words: dict[str, str]) -> str:
    """Return the label of a case, its place in a sweep and what is extreme in it."""
    place = ", ".join(f"{key} {value}" for key, value in case["position"].items())
    label = case["label"]
    if place:
        label = place if label == "base" else f"{label}, {place}"
    explanation = words.get(case["label"])
    return f"**{label}**" + (f": {explanation}" if explanation else "")


def one_a_line(text: str) -> str:
    """Return what is expected or found, a value a line, names with blanks."""
    return text.replace(", ", "<br>").replace("_", " ")


def found_text(case: dict[str, Any]) -> str:
    """Return what a case came to, with the reason of a refusal."""
    found = one_a_line(case["found"])
    if not case["met"]:
        found = f"**missed**: {found}"
    return f"{found}: {case['reason']}" if case["found"] == "refused" else found


def seconds_text(seconds: float) -> str:
    """Return a processor time in a unit that suits it."""
    return f"{1e3 * seconds:.0f} ms" if seconds < 0.1 else f"{seconds:.2g} s"


def title(name: str) -> str:
    """Return the title of a campaign."""
    return tomllib.loads((CAMPAIGNS / f"{name}.toml").read_text())["title"]


def anchor(heading: str) -> str:
    """Return the anchor of a heading, as GitHub makes it."""
    signs = (sign for sign in heading.lower() if sign.isalnum() or sign in " -")
    return "".join(signs).replace(" ", "-")


def table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table as Markdown."""
    cells = [heads, *(tuple(cell.replace("|", "\\|") for cell in row) for row in rows)]
    first, *others = [f"| {' | '.join(row)} |" for row in cells]
    return "\n".join([first, "|---" * len(heads) + "|", *others])


def kept() -> dict[str, Any]:
    """Return what is kept of each campaign, by name."""
    return json.loads(MEASURED.read_text()) if MEASURED.exists() else {}


def campaigns() -> list[str]:
    """Return the names of the campaigns."""
    return [file.stem for file in sorted(CAMPAIGNS.glob("*.toml"))]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--cases"]:
        measure(sys.argv[2], sys.argv[3:])
        sys.argv[1:] = []
    for chosen in campaigns() if sys.argv[1:] == ["all"] else sys.argv[1:]:
        measure(chosen)
    PAGE.write_text(page())
