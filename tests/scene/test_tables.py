import pytest

from wearlab.scene import Scene, SceneError
from wearlab.scene.merge import merge

UNITS = {"stiffness": "N/um"}
CSV = "# read off Fig. 4\nphase,stiffness\n0,300\n0.75,300\n0.75,200\n1,200\n"


def scene(table, folder, text=CSV, *, name="k.csv", units=UNITS, **options):
    (folder / name).write_text(text)
    stiffness = {"model": "tabulated", "file": name, "units": units, **options}
    return Scene.from_mapping(merge(table, {"mesh": {"stiffness": stiffness}}), folder)


def test_contents_become_part_of_the_scene(table, tmp_path):
    stiffness = scene(table, tmp_path).mesh.stiffness
    assert stiffness.along == "phase" and stiffness.of == "pair"
    assert stiffness.abscissa == (0.0, 0.75, 0.75, 1.0)
    assert stiffness.stiffness == (3e8, 3e8, 2e8, 2e8)


def test_path_positions_have_a_unit(table, tmp_path):
    text = CSV.replace("phase", "path_position")
    stiffness = scene(
        table, tmp_path, text, units={"stiffness": "N/m", "path_position": "mm"}
    ).mesh.stiffness
    assert stiffness.along == "path_position" and stiffness.abscissa == (
        0.0,
        7.5e-4,
        7.5e-4,
        1e-3,
    )


def test_identity_is_of_the_contents_not_of_the_path(table, tmp_path):
    one = scene(table, tmp_path)
    other = scene(
        table,
        tmp_path,
        CSV.replace("300", "0.3").replace("200", "0.2"),
        name="other.csv",
        units={"stiffness": "kN/um"},
    )
    assert one.id == other.id and "csv" not in one.canonical()
    changed = scene(table, tmp_path, CSV.replace("300", "301"), name="third.csv")
    assert changed.id != one.id
    assert scene(table, tmp_path, of="mesh").id != one.id


def test_an_edited_file_is_read_again(table, tmp_path):
    before = scene(table, tmp_path)
    assert scene(table, tmp_path, CSV.replace("200", "1999")).id != before.id


def test_a_stored_table_needs_no_file(table, tmp_path):
    one = scene(table, tmp_path)
    (tmp_path / "k.csv").unlink()
    again = Scene.from_canonical(one.canonical())
    assert again == one and again.mesh.stiffness.file is None


@pytest.mark.parametrize(
    ("text", "units", "said"),
    [
        (
            "phase,k\n0,1\n",
            UNITS,
            "columns are phase, k; expected phase or path_position, and stiffness",
        ),
        ("phase,stiffness\n", UNITS, "no rows under a header"),
        (
            "phase,stiffness\n0,1\n1\n",
            UNITS,
            "k.csv: line 3: 1 columns instead of 2: '1'; every row",
        ),
        (
            "phase,stiffness\n0,x\n",
            UNITS,
            "k.csv: line 2, column 'stiffness': 'x' is no number",
        ),
        ("phase,stiffness\n0,nan\n", UNITS, "not finite"),
        ("phase,stiffness\n1,1\n0,1\n", UNITS, "phase descends"),
        ("phase,stiffness\n0,1\n0,1\n0,1\n", UNITS, "three times"),
        ("phase,stiffness\n0,-1\n", UNITS, "must not be negative"),
        (CSV, {"stiffness": "N"}, "units.stiffness: 'N' is not a unit like 'N/m'"),
        (CSV, {}, "units.stiffness is required"),
        (
            CSV.replace("phase", "path_position"),
            UNITS,
            "units.path_position is required, such as 'm'",
        ),
    ],
)
def test_a_wrong_table_is_refused(table, tmp_path, text, units, said):
    with pytest.raises(SceneError) as caught:
        scene(table, tmp_path, text, units=units)
    assert said in str(caught.value) and str(caught.value).startswith(
        "scene.mesh.stiffness"
    )


def test_a_missing_file_and_missing_keys(table, tmp_path):
    for stiffness, said in [
        ({"file": "no.csv", "units": UNITS}, "cannot read no.csv: No such file"),
        ({"units": UNITS}, "'file' is required"),
        ({"file": "no.csv"}, "cannot read no.csv: No such file"),
        (
            {"file": "no.csv", "units": UNITS, "stiffness": [1.0]},
            "'stiffness' is read from file, not written",
        ),
        (
            {"file": "no.csv", "units": UNITS, "abscissa": 3},
            "'abscissa' is read from file, not written",
        ),
        (
            {"file": "no.csv", "units": "N/m"},
            "units: 'N/m' is no table: write units = { stiffness = ",
        ),
        (
            {"file": "no.csv", "units": {"stiffness": 3}},
            "units.stiffness: 3 is no text: write units =",
        ),
        ({"file": 3, "units": UNITS}, "file: 3 is no text"),
    ]:
        with pytest.raises(SceneError, match=said):
            Scene.from_mapping(
                merge(
                    table, {"mesh": {"stiffness": {"model": "tabulated", **stiffness}}}
                ),
                tmp_path,
            )
