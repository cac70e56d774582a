"""``wearlab new``: files that load as they are, and still do with
what they offer in comments.
"""

import json
import re
import tomllib

import pytest

import wearlab as wl
from wearlab.campaign import editors_schema
from wearlab.cli.app import status_of
from wearlab.cli.commands.schema import SCHEMA, STARTS, kinds


@pytest.mark.parametrize("kind", kinds())
def test_a_file_of_every_kind_loads_and_is_of_the_schema(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert status_of(["new", kind]) == 0
    text = (tmp_path / f"{kind}.toml").read_text()
    assert text.startswith(f"#:schema ./{SCHEMA}\n") and "{file}" not in text
    schema = json.loads((tmp_path / SCHEMA).read_text())
    assert set(tomllib.loads(text)) <= set(schema["properties"])
    campaign = wl.load(tmp_path / f"{kind}.toml")
    assert len(campaign.cases) == 3 and campaign.figures and campaign.report.lead


@pytest.mark.parametrize("kind", kinds())
def test_what_a_file_offers_in_comments_is_valid_too(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert status_of(["new", kind, "--out", "mine.toml"]) == 0
    text = (tmp_path / "mine.toml").read_text()
    offered = re.sub(
        r"^# (?=\[\[?(dynamics|errors|case)\]|model = "
        r"|iso_|seed|label|\"gears|damping_ratio)",
        "",
        text,
        flags=re.M,
    )
    assert offered.count("\n#") < text.count("\n#") - 6
    (tmp_path / "mine.toml").write_text(offered)
    campaign = wl.load(tmp_path / "mine.toml")
    assert (
        len(campaign.cases) == 4 and campaign.cases[0].scene.errors.iso_1328_class == 7
    )


def test_no_file_is_written_over_and_unknown_kinds_are_refused(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fzg.toml").write_text("mine")
    assert (
        status_of(["new", "fzg"]) == 2 and "is there already" in capsys.readouterr().err
    )
    assert (
        status_of(["new", "planetari"]) == 2
        and "did you mean 'planetary'?" in capsys.readouterr().err
    )
    assert [path.name for path in tmp_path.iterdir()] == ["fzg.toml"]


def test_every_file_that_comes_along_is_of_the_schema_that_editors_read():
    """Every file with `extends` was marked wrong from its first line to its last."""
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(editors_schema())
    kind_of = jsonschema.Draft202012Validator
    kind_of.check_schema(schema)
    campaigns = STARTS.parents[2] / "campaigns"
    files = [
        file for file in campaigns.rglob("*.toml") if file.parent.name != "plugins"
    ]  # they have keys of their own
    for file in [*files, *STARTS.glob("*.toml")]:
        wrong = jsonschema.exceptions.best_match(
            kind_of(schema).iter_errors(tomllib.loads(file.read_text()))
        )
        assert wrong is None, (
            file.name,
            list(wrong.absolute_path),
            wrong.message[:200],
        )
    for wrong in (
        {"opration": {}},
        {"operation": {"speeds": "1 rpm"}},
        {"gears": {"pinion": {"tooth": 1}}},
    ):
        assert not kind_of(schema).is_valid(wrong)


@pytest.mark.parametrize(
    ("kind", "base"), [("fzg", "fzg_type_c"), ("wind-stage", "wind_stage")]
)
def test_a_rig_to_begin_with_is_the_base_file_of_the_campaigns(kind, base):
    shipped = STARTS.parents[2] / "campaigns" / "base" / f"{base}.toml"
    mine, other = (
        tomllib.loads(path.read_text()) for path in (STARTS / f"{kind}.toml", shipped)
    )
    for section in ("gears", "operation", "lubricant"):
        assert mine[section] == other[section]
