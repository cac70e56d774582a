"""A campaign as a research object crate, by the rules of RO-Crate 1.1."""

import json
import zipfile
from dataclasses import replace
from types import SimpleNamespace

import netCDF4
import pytest
from fake_campaign import filled, sweep

from wearlab.store.export import CONTEXT, DESCRIPTOR, SPECIFICATION, export_crate

WHO = {
    "author": "A. Author; B. Author",
    "licence": "https://spdx.org/licenses/CC-BY-4.0",
    "institution": "I",
}
ROOT = ("name", "description", "datePublished", "license", "hasPart")


@pytest.fixture
def campaign(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text('title = "study"\n')
    made = sweep(3)
    return SimpleNamespace(
        **{
            name: getattr(made, name)
            for name in ("title", "axes", "cases", "reference")
        },
        path=file,
        metadata=WHO,
    )


def written(campaign, tmp_path, name="out.zip"):
    store = filled(tmp_path / "store", replace(sweep(3), title="study"))
    figure = tmp_path / "01-wear.png"
    figure.write_bytes(b"\x89PNG")
    return export_crate(campaign, store, tmp_path / name, [figure])


def test_it_is_a_crate(campaign, tmp_path):
    with zipfile.ZipFile(written(campaign, tmp_path)) as crate:
        assert crate.testzip() is None
        names = set(crate.namelist())
        told = json.loads(crate.read(DESCRIPTOR))
    assert told["@context"] == CONTEXT and set(told) == {"@context", "@graph"}
    graph = {entity["@id"]: entity for entity in told["@graph"]}
    assert len(graph) == len(told["@graph"]), "every entity stands once"
    about = graph[DESCRIPTOR]
    assert about["@type"] == "CreativeWork" and about["about"] == {"@id": "./"}
    assert about["conformsTo"] == {"@id": SPECIFICATION}
    root = graph["./"]
    assert root["@type"] == "Dataset" and all(root[key] for key in ROOT)
    parts = {part["@id"] for part in root["hasPart"]}
    assert (
        parts
        == names - {DESCRIPTOR}
        == {"runs.nc", "campaign.toml", "CITATION.txt", "figures/01-wear.png"}
    )
    assert all(
        graph[part]["@type"] == "File" and graph[part]["encodingFormat"]
        for part in parts
    )
    assert [graph[one["@id"]]["name"] for one in root["author"]] == [
        "A. Author",
        "B. Author",
    ]
    for entity in told[
        "@graph"
    ]:  # flat: what an entity refers to is told by an entity of its own
        for value in entity.values():
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, dict):
                    assert set(one) == {"@id"} and (
                        one["@id"] in graph or one["@id"] == SPECIFICATION
                    )


def test_what_is_in_it_is_what_was_stored(campaign, tmp_path):
    with zipfile.ZipFile(written(campaign, tmp_path)) as crate:
        with netCDF4.Dataset("memory", memory=crate.read("runs.nc")) as file:
            assert len(file.dimensions["speed"]) == 3 and file.license == WHO["licence"]
        assert 'title = "study"' in crate.read("campaign.toml").decode()
        assert "A. Author; B. Author" in crate.read("CITATION.txt").decode()


def test_the_same_store_gives_the_same_words(campaign, tmp_path):
    told = []
    for name in ("one.zip", "two.zip"):
        with zipfile.ZipFile(written(campaign, tmp_path, name)) as crate:
            told.append(
                [
                    crate.read(DESCRIPTOR),
                    [(e.filename, e.date_time) for e in crate.infolist()],
                ]
            )
    assert told[0] == told[1]
