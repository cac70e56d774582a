"""How a run is cited."""

import json

from fake_campaign import sweep

from wearlab.store.export import _citation
from wearlab.store.provenance import bibtex, citation, facts_of
from wearlab.store.used_plugins import plugins_of_scene


def test_a_citation_names_the_run_the_code_and_both_hashes(fill, tmp_path):
    campaign = sweep(1)
    store = fill(campaign)
    run_id = campaign.cases[0].id
    file = tmp_path / "gone.toml"
    store.archive.catalogue.record_campaign(
        "Wear & 100 % {µ}",
        "doi:10/x",
        str(file),
        [(run_id, "base", {"speed": "1 rpm"})],
    )
    facts = facts_of(store, run_id[:8])
    entry = store.archive.entries([run_id])[run_id]
    assert facts["sha256"] == entry.sha256
    assert facts["content_sha256"] == store.run(run_id).attrs["content_sha256"]
    told = citation(facts)
    year = facts["date"][
        :4
    ]  # without an author the title stands first, as APA has it: was "(2026). Wear …"
    assert told.startswith(
        f"Wear & 100 % {{µ}}, speed 1 rpm [data set]. ({year}). Run {run_id}"
    )
    assert _citation({"title": "Wear", "date_created": "2026-01-01"}).startswith(
        "Wear [data set]. (2026)"
    )
    assert citation({**facts, "institution": "A Works"}).startswith(
        f"A Works. ({year}). Wear"
    )
    assert "sources abc" in told and "After doi:10/x." in told and entry.sha256 in told
    entry_text = bibtex(facts)
    assert r"Wear \& 100 \% \{µ\}, speed 1 rpm [data set]" in entry_text
    assert entry_text.count("{") - entry_text.count(r"\{") == entry_text.count(
        "}"
    ) - entry_text.count(r"\}")


def test_the_campaign_that_names_its_authors_speaks_for_its_runs(fill, tmp_path):
    """Neither a scratch list of scenes nor a later campaign without
    authors takes the title away.
    """
    campaign = sweep(1)
    store = fill(campaign)
    run_id = campaign.cases[0].id
    case = [(run_id, "base", {"speed": "1 rpm"})]
    store.archive.catalogue.record_campaign(
        "Ours", None, "a.toml", case, {"author": "A. Author; B. Writer"}
    )
    store.archive.catalogue.record_campaign("Later", None, "b.toml", case)
    store.archive.catalogue.record_campaign(
        "2 scenes", None, None, [(run_id, "base", {"scene": "0"})]
    )
    facts = facts_of(store, run_id)
    year = facts["date"][:4]
    assert citation(facts).startswith(
        f"A. Author, B. Writer. ({year}). Ours, speed 1 rpm [data set]. Run"
    )
    assert "author = {A. Author and B. Writer}" in bibtex(
        facts
    ) and "@software{wearlab," in bibtex(facts)
    assert facts["also_in"].startswith("2 scenes; Later")


def test_a_citation_names_the_plugins_of_a_run_with_their_hashes(tmp_path):
    law, result, other = "a1" * 32, "b2" * 32, "c3" * 32
    (tmp_path / "plugins").mkdir()
    for sha256, name in ((law, "law.py"), (other, "result.py")):
        text = json.dumps({"name": name, "source": ""})
        (tmp_path / "plugins" / f"{sha256}.json").write_text(text)
    scene = {
        "wear": {"law": {"name": "mine", "plugin": law}},
        "mesh": {"plugin": {"file": "mesh.py", "sha256": result}},
        "store": {"results": {"a": other}},
    }
    used = plugins_of_scene(json.dumps(scene), tmp_path)
    assert used == [("law.py", law), ("mesh.py", result), ("result.py", other)]
    facts = {"id": "1" * 20, "plugins": "; ".join(map(str, used))}
    for text in (citation(facts), bibtex(facts)):
        assert f"law.py (SHA-256 {law})" in text
        assert f"result.py (SHA-256 {other})" in text
    assert plugins_of_scene("[" * 100_000, tmp_path) == []
    assert plugins_of_scene('{"plugin": "a word"}', tmp_path) == []
