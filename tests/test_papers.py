"""What the code cites exists in the docs, and what the docs print is true."""

import re
from pathlib import Path

import pytest

import wearlab
from wearlab.campaign.json_schema import schema_json

TOP = Path(__file__).parents[1]
DOCS = TOP / "docs"
PACKAGE = Path(wearlab.__file__).parent
SOURCE = re.compile(r'"source": "([^"]+)"')


def test_sections_of_physics_that_the_code_cites_exist():
    there = set(
        re.findall(r"^## (\d+)\.", (DOCS / "physics.md").read_text(), re.MULTILINE)
    )
    cited = {
        number
        for file in PACKAGE.rglob("*.py")
        for number in re.findall(r"PHYSICS §(\d+)", file.read_text())
    }
    assert cited and cited <= there


def test_sources_of_options_are_in_the_bibliography():
    known = (DOCS / "bibliography.md").read_text()
    for said in set(SOURCE.findall(schema_json())):
        for one in re.split(r"[;,] ", said.partition(":")[0]):
            name = re.split(
                r" (?:Eqs?\.|Fig\.|Table|Algorithm|after|f_|by)|[-:]\d|\d{4,}-", one
            )[0].strip()
            if re.match(r"[A-Z]", name) and not re.match(r"(?:Eq|Fig|HRC|HB)", name):
                assert name.split(" & ")[0].split()[0] in known, (name, said)


def test_slots_that_the_docs_list_are_those_there_are():
    # so that every section has registered its slots
    from wearlab.scene import Scene  # noqa: F401
    from wearlab.slots import Slot

    listed = set(
        re.findall(
            r"^\| `([a-z._]+)` \| `wearlab",
            (DOCS / "plugins.md").read_text(),
            re.MULTILINE,
        )
    )
    assert listed == set(Slot.all)


@pytest.mark.parametrize(
    "file", sorted((TOP / "campaigns" / "plugins").glob("*.py")), ids=lambda f: f.stem
)
def test_examples_of_plugins_are_told(file):
    assert f"`{file.stem}`" in (DOCS / "plugins.md").read_text()
    assert file.with_suffix(".toml").exists()


def test_folders_that_the_docs_name_exist():
    for folder in re.findall(
        r"`wearlab/([a-z_/]+)/<name>.py`", (DOCS / "where_to_add.md").read_text()
    ):
        assert (PACKAGE / folder / "__init__.py").exists(), folder
