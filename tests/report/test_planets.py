"""A page says which planet wears most, where planets differ."""

from wearlab.report.answer import CaseAnswer, _worn_planets


def test_the_planet_that_wears_most_is_named_with_its_cases():
    cases = [
        CaseAnswer("base", "7 h", planet=3),
        CaseAnswer("seed 2", "8 h", planet=1),
        CaseAnswer("seed 3", "9 h", planet=3),
    ]
    assert list(_worn_planets(cases)) == [
        "Of the planets, which differ, planet 3 wears most (base, seed 3).",
        "Of the planets, which differ, planet 1 wears most (seed 2).",
    ]
    assert not list(_worn_planets([CaseAnswer("base", "7 h")]))
