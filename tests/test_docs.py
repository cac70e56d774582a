"""README and docs: every file and command in them runs as it is printed.

Reference pages say everything.
"""

import importlib.util
import os
import pkgutil
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from wearlab.campaign import load
from wearlab.campaign.claims import check_record, stale
from wearlab.scene.identity import MODEL_VERSION

TOP = Path(__file__).parents[1]
DOCS = TOP / "docs"
PAGES = sorted(
    {
        TOP / "README.md",
        *DOCS.glob("*.md"),
        *(DOCS / "evidence").glob("*.md"),
        *(DOCS / "tutorials").glob("*.md"),
    }
)
ALL_PAGES = sorted({TOP / "CHANGELOG.md", *PAGES, *DOCS.rglob("*.md")})
BLOCK = re.compile(r"^```(\w+) *([^\n]*)\n(.+?)^```", re.DOTALL | re.MULTILINE)
PLACE = re.compile(
    r"(?<![\w/.<-])((?:wearlab|tests|docs|campaigns|\.ci)/[\w./*-]*+)"
    r"(?!<|`[^`]*```python|`? \(new\))"
)
"""A path of this repository, unless the page goes on to write that file."""
LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
DOTTED = re.compile(r"`(wearlab(?:\.\w+)+)`")
CLASS = re.compile(r"`([A-Z][a-z]+\w*)(?:\.\w+)?`")
ENTRY_POINTS = "wearlab.variants"
DRIVER = """
import subprocess, sys
from pathlib import Path

if __name__ == "__main__":
    names = {"__name__": "session"}
    for path in sorted(Path("blocks").iterdir()):
        print("##", path.name, flush=True)
        if path.suffix == ".py":
            exec(compile(path.read_text(), path.name, "exec"), names)
        else:
            subprocess.run(["bash", "-euc", path.read_text()], check=True)
"""


def blocks(page):
    """Return the blocks of a page: language, what follows it, text."""
    return BLOCK.findall(page.read_text())


def sessions(page):
    return [
        (lang, text)
        for lang, name, text in blocks(page)
        if name == "session" or name == "optuna"
    ]


def reference_pages(name="reference_pages"):
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def page_name(page):
    return page.relative_to(TOP).as_posix()


def resolves(dotted):
    """Return whether a dotted name is a module or stands in one."""
    try:
        pkgutil.resolve_name(dotted)
    except (ImportError, AttributeError):
        return False
    return True


@pytest.mark.parametrize("page", ALL_PAGES, ids=page_name)
def test_every_path_link_and_module_on_a_page_exists(page):
    text = page.read_text()
    paths = [path.rstrip(".-") for path in PLACE.findall(text)]
    modules = set(DOTTED.findall(text)) - {ENTRY_POINTS}

    absent = [path for path in paths if not any(TOP.glob(path))]
    absent += [link for link in LINK.findall(text) if not (page.parent / link).exists()]
    absent += [name for name in modules if not resolves(name)]

    assert not absent


@pytest.mark.parametrize("name", ("develop.md", "glossary.md"))
def test_every_type_that_developers_are_told_of_exists(name):
    sources = [file.read_text() for file in (TOP / "wearlab").rglob("*.py")]
    classes = re.findall(r"^class (\w+)", "".join(sources), re.MULTILINE)

    mentioned = set(CLASS.findall((DOCS / name).read_text()))

    assert mentioned <= {*classes, "Dataset", "None"}


def test_the_readme_is_short_and_has_two_commands():
    readme = TOP / "README.md"
    assert len(readme.read_text().splitlines()) < 80
    assert [name for lang, name, _ in blocks(readme) if lang == "sh"] == [
        "set-up",
        "set-up",
    ]
    for target in re.findall(r"\]\(([^)#:]+)\)", readme.read_text()):
        assert (TOP / target).exists(), target


def test_every_campaign_is_told():
    table = "".join(
        line
        for line in (DOCS / "campaigns.md").read_text().splitlines()
        if line.startswith("|")
    )
    listed = [Path(name) for name in re.findall(r"`([^`]+\.(?:toml|csv))`", table)]
    for file in (TOP / "campaigns").rglob("*.toml"):
        assert any(
            file.relative_to(TOP / "campaigns").match(str(one)) for one in listed
        ), file
    for one in listed:
        assert list((TOP / "campaigns").glob(str(one))), one


@pytest.mark.parametrize(
    "page", PAGES, ids=lambda page: page.relative_to(TOP).as_posix()
)
def test_every_command_on_a_page_exists_with_its_options(page):
    import typer

    from wearlab.cli.app import app

    group = typer.main.get_command(app)
    lines = [
        line
        for lang, _, text in blocks(page)
        if lang == "sh"
        for line in re.split(r"\n|&&", text)
    ]
    for line in lines:
        words = re.findall(r'"[^"]*"|\S+', line.partition(" #")[0])
        if words and Path(words[0]).name == "wearlab" and not words[1].startswith("-"):
            command = group.commands[words[1]]
            known = {
                option
                for one in (*command.params, *group.params)
                for option in one.opts
            }
            asked = {
                word.partition("=")[0] for word in words[2:] if word.startswith("--")
            }
            assert asked <= known | {"--help"}, line


def test_reference_pages_name_everything():
    pages = reference_pages()
    from wearlab.cli.app import app
    from wearlab.figures import KINDS
    from wearlab.schema import VARIABLES

    variables = pages.variables()
    kinds = pages.figures()
    assert all(f"`{name}`" in variables for name in VARIABLES)
    assert all(f"`{name}`" in kinds for name in KINDS)
    told = pages.commands()
    assert all(
        f"\n## {one.name or one.callback.__name__}\n" in told
        for one in app.registered_commands
    )
    options = pages.options()
    for name in (
        "face_width",
        "viscosity",
        "until",
        "planet_angles",
        "normal_backlash",
        "correlation",
    ):
        assert f"`{name}`" in options
    checks = pages.checks()
    assert "| test" not in checks
    assert "`test_every_extreme_case_ends_as_its_file_expects`" in checks


def test_reference_pages_are_those_of_this_code(tmp_path):
    """They are committed, so that a clone has what is linked to:
    ``python docs/reference_pages.py``.
    """
    reference_pages().write(tmp_path)
    made = {file.name: file.read_text() for file in tmp_path.iterdir()}
    kept = {name: (DOCS / "reference" / name).read_text() for name in made}
    assert [name for name in made if made[name] != kept[name]] == []


@pytest.fixture(scope="module")
def papers():
    """The module that makes the papers' pages, and what is kept of
    every campaign that they name.
    """
    made = reference_pages("papers_pages")
    return made, made.all_kept()


def test_every_claim_of_every_campaign_holds(papers):
    """On runs of today's scenes and model version: ``python
    docs/papers_pages.py STORE`` measures.
    """
    _, kept = papers
    claiming = {
        file.stem
        for file in (TOP / "campaigns").rglob("*.toml")
        if "\n[[claim]]" in file.read_text()
    }
    assert claiming <= set(kept)
    for name, (campaign, record, version, _) in kept.items():
        checked, lacking = check_record(campaign, record, stale(campaign, record))
        assert [
            (name, one.claim.name, one.reason) for one in checked if not one.holds
        ] == []
        assert (name, lacking, version) == (name, [], MODEL_VERSION)


def test_pages_of_papers_are_those_of_their_claims(papers):
    made, kept = papers
    for name, text in made.pages(kept).items():
        assert (made.PAPERS / name).read_text() == text, name
    shown = set(re.findall(r"\]\(images/([^)]+)\)", "".join(made.pages(kept).values())))
    assert shown == {file.name for file in (made.PAPERS / "images").iterdir()}
    assert {file.stem for file in made.MEASURED.iterdir()} == set(kept)


def test_papers_have_a_row_for_each_figure_table_and_conclusion(papers):
    """Silence is no answer: why something cannot be reproduced is one."""
    made, kept = papers
    counts = {
        "l16": (13, 1, 6),
        "w23": (12, 1, 3),
        "y23": (20, 1, 4),
        "b23": (12, 2, 4),
    }
    for file in made.files():
        paper = tomllib.loads(file.read_text())
        shown = {row[0] for row in made.rows(paper, kept)}
        for word, count in zip(
            ("Fig.", "Table", "Conclusion"), counts[file.stem], strict=True
        ):
            assert {f"{word} {number}" for number in range(1, count + 1)} <= shown
        assert all(any(row[2:]) for row in made.rows(paper, kept))


def test_quick_campaigns_are_those_whose_runs_take_seconds(papers):
    """A change is checked by new runs of these, and by what was
    measured of all others.
    """
    made, kept = papers
    quick = {Path(file).stem for file in made.quick(kept)}
    assert sum(kept[name].seconds for name in quick) < 90.0  # of one core
    assert all(0.0 < kept[name].seconds < 20.0 for name in quick)
    assert sum(len(kept[name].campaign.claims) for name in quick) > 100
    assert "papers_pages.py --quick" in (TOP / ".ci" / "run").read_text()


def test_the_page_of_errors_over_run_time_is_that_of_its_figures(monkeypatch):
    """``python docs/accuracy_pages.py all`` measures, by the time of the processor."""
    monkeypatch.syspath_prepend(str(DOCS))
    made = reference_pages("accuracy_pages")
    assert (DOCS / "accuracy.md").read_text() == made.page()
    assert set(made.kept()) <= set(made.campaigns()) and len(made.campaigns()) == 7
    for name in made.kept():
        assert {"work-precision", "life-time"} & set(made.images(name)), name
    shown = {f"{name}-{kind}.png" for name in made.kept() for kind in made.images(name)}
    assert shown == {file.name for file in made.IMAGES.iterdir()}


def test_the_page_of_extremes_is_that_of_what_was_run():
    """Of every case of every campaign: ``python docs/extremes_pages.py all``."""
    made = reference_pages("extremes_pages")
    assert made.PAGE.read_text() == made.page()
    kept = made.kept()
    assert set(kept) <= set(made.campaigns())
    for name, measured in kept.items():
        cases = load(made.CAMPAIGNS / f"{name}.toml").cases
        labels = [case["label"] for case in measured["cases"]]
        assert labels == [case.label for case in cases], name
        assert all(case["met"] for case in measured["cases"]), name
    words = tomllib.loads(made.TEXTS.read_text())
    assert set(words) == set(made.campaigns())
    for name, one in words.items():
        labels = {case.label for case in load(made.CAMPAIGNS / f"{name}.toml").cases}
        assert set(one.get("cases", {})) <= labels, name


def test_the_page_of_savings_is_that_of_what_was_measured():
    """``python tests/benchmarks/leaving_out.py docs/evidence/leaving_out.json``."""
    made = reference_pages("leaving_out_pages")
    assert made.PAGE.read_text() == made.page()
    for name, measured in made.kept().items():
        names = [part["name"] for part in measured["parts"]]
        assert names == [part.name for part in made.leaving_out.SETS[name]], name
        for part in measured["parts"]:
            assert part["difference"] <= part["tolerance"], (name, part["name"])


def test_readme_leads_to_the_evidence_in_one_click():
    table = (TOP / "README.md").read_text()
    for page in (
        "docs/accuracy.md",
        "docs/evidence/extremes.md",
        "docs/evidence/leaving_out.md",
    ):
        assert f"]({page})" in table, page


def test_every_link_leads_to_a_file():
    wrong = [
        f"{page.relative_to(TOP)}: {target}"
        for page in [
            *PAGES,
            *(DOCS / "reference").glob("*.md"),
            *(DOCS / "papers").glob("*.md"),
        ]
        for target in re.findall(
            r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", re.sub(r"`[^`]*`", "", page.read_text())
        )
        if not (page.parent / target).exists()
    ]
    assert wrong == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [p for p in PAGES if sessions(p)], ids=lambda page: page.stem
)
def test_a_page_runs_as_it_is_printed(page, tmp_path):
    (tmp_path / "campaigns").symlink_to(TOP / "campaigns")
    (tmp_path / "blocks").mkdir()
    has_optuna = importlib.util.find_spec("optuna") is not None
    number = 0
    for lang, name, text in blocks(page):
        if lang in ("toml", "python", "csv") and "." in name:
            (tmp_path / name).write_text(text)
        elif name == "session" or (name == "optuna" and has_optuna):
            number += 1
            (
                tmp_path
                / "blocks"
                / f"{number:02d}.{'py' if lang == 'python' else 'sh'}"
            ).write_text(text)
    (tmp_path / "driver.py").write_text(DRIVER)
    scripts = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": scripts}
    environment.pop("WEARLAB_STORE", None)
    done = subprocess.run(
        [sys.executable, "driver.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    (tmp_path / "told.txt").write_text(done.stdout)
    if page.stem == "tour":
        tour_tells(done.stdout, tmp_path)


def tour_tells(out, folder):
    first, extended, asked, branched, compared, redrawn, handed_on = re.split(
        r"## \d+\.sh\n", out
    )[1:]
    assert "2 new" in first and "2 of 2 done; 2 computed" in first
    assert (
        "1 new\n        2 cached" in extended and "3 of 3 done; 1 computed" in extended
    )
    assert asked.count("torque=") == 2 and "first_cycle(max_wear_depth > 5 um)" in asked
    assert "goes on from    run " in branched and "new flanks: pinion" in branched
    assert "start.replace.0" in compared and (folder / "compared.png").is_file()
    assert "the same bytes" in redrawn
    assert "Your Name. (" in handed_on and "4 runs compared, 0 problems" in handed_on
