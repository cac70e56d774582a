"""What is compiled ahead: one scene of every kind, not one of every run."""

from pathlib import Path

from wearlab.campaign import load
from wearlab.simulation import warm
from wearlab.simulation.warm import kinds_of

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"


def test_numbers_make_no_kind_but_choices_do():
    """Was a kind for each of a thousand drawn coefficients, a wear state of each before the first run."""
    thousand = [case.scene for case in load(CAMPAIGNS / "planetary_life_distribution.toml").cases]
    assert len(thousand) == 1000 and len(kinds_of(thousand)) == 1
    scene = thousand[0]
    others = [
        scene.replace("dynamics.method", "newmark"),
        scene.replace("wear.coefficient", {"model": "constant", "value": "1e-18 m^2/N", "film": False}),
        scene.replace("wear.coefficient", {"model": "constant", "value": "2e-18 m^2/N", "film": False}),
    ]
    assert len(kinds_of([scene, *others])) == 3


def test_who_has_waited_for_one_kernel_looks_at_all_jobs_again(monkeypatch):
    """Was a wait for the next kernel of another process, while the third could have been compiled here."""
    asked, done = [], set()

    def is_done(job, patient):
        asked.append((job, patient))
        if patient or job == "free" or (job == "after" and "waited for" in done):
            done.add(job)
        return job in done

    monkeypatch.setattr(warm, "kinds_of", list)
    monkeypatch.setattr(warm, "jobs_of", lambda kinds: ["free", "waited for", "busy", "after"])
    monkeypatch.setattr(warm, "is_done", is_done)
    warm.warm_up([], turn=1, workers=2)
    waited = asked.index(("waited for", True))
    assert ("after", False) in asked[waited : asked.index(("busy", True))]
    assert ("after", True) not in asked and len(done) == 4
