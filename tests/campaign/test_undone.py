import pytest

from wearlab.campaign import load

BASE = "campaigns/base/planetary_ngw11_"
PUBLISHED = f"{BASE}life_as_published.toml"
VIBRATION = f"{BASE}vibration.toml"


def test_a_base_file_reached_again_is_told_with_what_it_sets_back():
    trapped = load({"extends": [PUBLISHED, VIBRATION]})
    assert trapped.cases[0].scene.gears.centre_distance.sun_planet == pytest.approx(
        0.0565
    )
    told = next(line for line in trapped.warnings if "gears.centre_distance" in line)
    assert (
        "planetary_ngw11.toml is reached again after "
        "planetary_ngw11_life_as_published.toml" in told
    )
    assert told.endswith("put planetary_ngw11_life_as_published.toml last")


@pytest.mark.parametrize(
    "table",
    [
        {"extends": [VIBRATION, PUBLISHED]},
        {"extends": "campaigns/planetary_speed_as_published.toml"},
        {
            "extends": [PUBLISHED, VIBRATION],
            "gears": {
                "centre_distance": "56.5 mm",
                "sun": {"profile_shift_coefficient": 0.35},
            },
        },
    ],
)
def test_what_holds_or_is_set_by_the_file_itself_is_not(table):
    assert load(table).warnings == ()
