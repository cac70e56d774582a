"""What an update is of does not hang on where its files lie."""

import shutil

import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.updating.identity import subject_of

UPDATES = sorted(file.name for file in CAMPAIGNS.glob("update_*.toml"))


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    folder = tmp_path_factory.mktemp("elsewhere") / "campaigns"
    return shutil.copytree(CAMPAIGNS, folder)


@pytest.mark.parametrize("name", UPDATES)
def test_a_copy_asks_the_same(name, elsewhere):
    """The path of a load record was part of it: no copy knew the update again."""
    assert subject_of(load(elsewhere / name)) == subject_of(load(CAMPAIGNS / name))


def test_another_record_asks_something_else(elsewhere, tmp_path):
    copy = shutil.copytree(elsewhere, tmp_path / "campaigns")
    name = "update_department.toml"
    before = subject_of(load(copy / name))
    record = copy / "measured" / "department_loads.csv"
    lines = record.read_text(encoding="utf-8").splitlines()
    record.write_text("\n".join(lines[:-1]) + "\n", encoding="utf-8")
    assert subject_of(load(copy / name)) != before
