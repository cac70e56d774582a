"""What a strict campaign may say: readings, quotations, directions, tolerances."""

import pytest

from wearlab.campaign.campaign import Campaign, FigureSpec
from wearlab.campaign.claims import ClaimRecord, ClaimSpec, MeasuredClaim, spelled_note
from wearlab.campaign.readings import points_of, read_readings
from wearlab.campaign.statements import problems
from wearlab.cli.app import status_of

FIRST = "paper, place, name, at, printed\nX20, Fig. 1, growth, , 30 %\n"
SECOND = "paper, place, printed\nX20, Fig. 1, 30.0 %\n"
CLAIM = {
    "name": "growth",
    "quantity": "max(depth)",
    "value": "20 %",
    "tolerance": "2 %",
}


@pytest.fixture
def tables(tmp_path):
    first = tmp_path / "first.csv"
    second = tmp_path / "second.csv"
    first.write_text(FIRST)
    second.write_text(SECOND)
    return first, second


def said(tables, note, claim=None):
    """Return what is wrong with a note, and with a claim of a growth of 20 %."""
    spec = ClaimSpec(**(CLAIM | (claim or {})))
    measured = MeasuredClaim(
        name="growth", formula="max(depth)", unit="%", measured=20.0
    )
    numbers = {spelled_note("{growth:.0f}", [spec]): "20"}
    record = ClaimRecord(runs=(), claims=(measured,), numbers=numbers)
    figure = FigureSpec(kind="line", note=note)
    campaign = Campaign(
        "Growth", None, {}, (), figures=(figure,), claims=(spec,), readings=tables
    )
    return problems(campaign, record)


@pytest.mark.parametrize(
    "note",
    [
        "It {grows|growth} by {growth:.0f = 20} %, X20: {'30 %' X20 Fig. 1} (Fig. 3).",
        "As Eqs. 9 to 12 of X20 have it.",
        "It {doubles|growth / 10}.",
    ],
)
def test_what_is_borne_out_is_let_through(tables, note):
    assert said(tables, note) == []


@pytest.mark.parametrize(
    "note, message",
    [
        ("By 20 %.", "'20 %' is no number of this file"),
        ("By {growth:.0f = 30} %.", "the runs give 20"),
        ("By {growth:.0f} %.", "write {growth:.0f = 20}"),
        ("X20: {'20 %' X20 Fig. 1}.", "X20 Fig. 1 does not print that"),
        ("It rises.", "'rises' is a claim by itself"),
        ("It {falls|growth}.", "it is 20"),
        ("It {halves|growth / 10}.", "it is 2"),
        ("It {falls|shrinkage}.", "no claim 'shrinkage' was measured"),
        ("It {flies|growth}.", "no word of direction; there are rise, rises"),
        ("{smallest|growth}.", "max(depth) is not the smallest"),
    ],
)
def test_what_nothing_bears_out_is_told(tables, note, message):
    (line,) = said(tables, note)
    assert "figure 1 (line): note: " in line and message in line


@pytest.mark.parametrize(
    "claim, message",
    [
        ({"printed": "31 %", "source": "X20 Fig. 1"}, "the readings have '30 %'"),
        ({"tolerance": "300 %"}, 'beginning with "300 %: "'),
        ({"tolerance": "9 %", "loose": "8 %: rough"}, 'begin it with "9 %: "'),
    ],
)
def test_what_is_wrong_with_a_claim_is_told(tables, claim, message):
    (line,) = said(tables, "", claim)
    assert line.startswith("claim growth: ") and message in line


def test_the_remedy_of_a_wide_tolerance_works(tables):
    assert said(tables, "", {"tolerance": "9 %", "loose": "9 %: rough"}) == []


def test_a_number_of_one_reading_alone_is_told(tables):
    first, second = tables
    second.write_text(SECOND.replace("30.0", "31"))
    lines = read_readings(first, second).problems
    assert len(lines) == 2 and all("look the paper up" in line for line in lines)


def test_points_without_y_are_places_along_x(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("# of a paper\nx [Hz], mesh\n112, sun\n")
    assert list(points_of(file)) == [("sun", "112 Hz")]


@pytest.mark.parametrize(
    "line, message",
    [
        ('readings = ["a.csv"]', "is no list of two files"),
        ('readings = ["a.csv", "b.csv"]', "a.csv"),
    ],
)
def test_readings_that_cannot_be_read_are_refused(
    line, message, tmp_path, request, capsys
):
    base = request.config.rootpath / "campaigns" / "base" / "spur_50_50.toml"
    file = tmp_path / "study.toml"
    file.write_text(f'title = "Study"\n{line}\nextends = "{base}"\n')
    kept = tmp_path / "kept.json"
    kept.write_text('{"runs": [], "claims": [], "numbers": {}}')
    assert status_of(["check", str(file), "--claims", "--measured", str(kept)]) == 2
    assert message in capsys.readouterr().err
