import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import create_model
from scenes import external_pair

from wearlab.options import Number, Part, option
from wearlab.scene import Scene
from wearlab.scene.identity import canonical, essence, stored
from wearlab.scene.mesh import MeshSection, OneMesh

SUPPORT = {"radial_stiffness": "1150 N/um", "damping": "5360 N*s/m"}


def changed(table, key, value):
    section, _, word = key.rpartition(".")
    inner = table
    for part in section.split("."):
        inner = inner.setdefault(part, {})
    inner[word] = value
    return Scene.from_mapping(table)


@pytest.mark.parametrize(
    ("key", "one", "other"),
    [
        ("operation.speed", "1100 rpm", "1.1e3 rpm"),
        ("operation.speed", "1100 rpm", "1100 1/min"),
        ("operation.torque", "340 N*m", "0.34 kNm"),
        ("gears.face_width", "20 mm", "2 cm"),
        ("gears.pinion.teeth", 50, 50.0),
        ("wear.until.cycles", 100000000, 1e8),
        ("mesh.stiffness", "potential-energy", {"model": "potential-energy"}),
        ("mesh.stiffness", {"scale": 1}, {"scale": 1.0}),
        ("mesh.stiffness", {}, {"hertz": "weber"}),
        ("mesh.damping_in", "contact", "contact"),
        (
            "gears.material",
            "steel",
            {
                "youngs_modulus": "206 GPa",
                "poisson_ratio": 0.3,
                "density": "7.83 g/cm^3",
            },
        ),
        ("wear.load", "instant", "instant"),
        ("wear.snapshots.cycles", [3e6, 2e7], [2e7, 3000000, 3e6]),
        ("wear.coefficient.gear", {}, {"factor": 1}),
        ("wear.coefficient.gear", {}, {"factor": 1.0000000000000002}),
        ("wear.snapshots.cycles", [3e6], [3e6, 3000000.0000000005]),
        ("numerics.tolerance", 1e-3, 0.001),
        ("gears.pinion.profile_shift_coefficient", 0, 0.0),
        ("gears.pinion.profile_crowning", "0 um", "-0.0 um"),
        ("gears.face_width", "20 mm", "20.00000000000001 mm"),
    ],
)
def test_equal_scenes_share_an_id(table, key, one, other):
    a = changed(table, key, one)
    b = changed(table, key, other)
    assert a == b and a.id == b.id and a.canonical() == b.canonical()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("operation.speed", "1100.00001 rpm"),
        ("operation.drive_flank", "left"),
        ("gears.gear.teeth", 51),
        ("gears.pinion.bore_diameter", "40 mm"),
        ("mesh.normal_backlash", "0 um"),
        ("mesh.stiffness.scale", 0.99),
        ("numerics.tolerance", 1e-4),
        ("wear.snapshots.cycles", [3e6]),
        ("store.variables", ["wear_depth"]),
        ("errors.seed", 0),
    ],
)
def test_everything_that_matters_changes_the_id(table, key, value):
    before = Scene.from_mapping(table)
    after = changed(table, key, value)
    assert before != after and before.id != after.id


def test_defaults_are_filled_in(table):
    said = json.loads(Scene.from_mapping(table).canonical())
    assert said["mesh"]["stiffness"]["hertz"] == "weber"
    assert said["wear"]["load"] == "instant"
    assert "errors" not in said and "lubricant" not in said
    written = {
        **table,
        "mesh": {**table["mesh"], "contact": "displacement", "damping_in": "contact"},
    }
    assert Scene.from_mapping(written) == Scene.from_mapping(table)


def test_the_id_is_short_and_knows_the_model_version(table, monkeypatch):
    scene = Scene.from_mapping(table)
    assert len(scene.id) == 20 and int(scene.id, 16) >= 0
    monkeypatch.setattr("wearlab.scene.identity.MODEL_VERSION", 999)
    assert Scene.from_mapping(table).id != scene.id


SECTIONS = ("mesh", "errors", "dynamics", "lubricant", "wear", "numerics", "store")


def grown(part):
    """Return a part with one option more, as a later version might have."""
    return create_model(
        part.__name__, __base__=part, an_option_more=(Number, option(0.5, "new"))
    )


@pytest.mark.parametrize("section", SECTIONS)
def test_an_option_added_with_a_default_makes_no_stored_run_new(full, section):
    scene = Scene.from_mapping(full)
    later = grown(type(getattr(scene, section)))
    standard = later() if section in ("mesh", "numerics", "store") else ...
    new_section = {section: (later, option(standard, "a section"))}

    class Newer(Scene):
        _model = create_model("Newer", __base__=Scene._model, **new_section)

    same = Newer.from_mapping(full)
    other = Newer.from_mapping(
        {**full, section: {**full[section], "an_option_more": 2}}
    )
    assert "an_option_more" in same.canonical()
    assert same.id == scene.id != other.id


def test_what_identity_sees():
    class Inner(Part):
        model: str = option("a", "which")
        size: Number = option(1.0, "size")

    class Outer(Part):
        needed: Number = option(..., "required")
        inner: Inner = option(Inner(), "a part with a default")
        maybe: Inner | None = option(None, "a part that may be absent")
        many: tuple[Inner, ...] = option((), "parts")

    assert essence(Outer(needed=2)) == {"needed": 2.0}
    assert essence(Outer(needed=2, inner={"size": 1})) == {"needed": 2.0}
    assert essence(Outer(needed=2, inner={"size": 1 + 1e-15})) == {"needed": 2.0}
    assert essence(Outer(needed=2, inner={"size": 3})) == {
        "needed": 2.0,
        "inner": {"model": "a", "size": 3.0},
    }
    assert essence(Outer(needed=2, maybe={})) == {
        "needed": 2.0,
        "maybe": {"model": "a"},
    }
    assert essence(Outer(needed=2, many=[{}])) == {
        "needed": 2.0,
        "many": [{"model": "a"}],
    }


def test_where_a_mesh_says_it_does_not_matter():
    said = MeshSection(
        sun_planet={"damping_in": "always"}, planet_ring={"damping_in": "always"}
    )
    assert (
        essence(said)
        == essence(MeshSection(damping_in="always"))
        == {"damping_in": "always"}
    )
    own = MeshSection(
        face_load_factor=1.2,
        sun_planet=OneMesh(damping_in="always", face_load_factor=1.2),
    )
    assert essence(own) == {
        "sun_planet": {"damping_in": "always", "face_load_factor": 1.2},
        "planet_ring": {"face_load_factor": 1.2},
    }


def test_a_stored_scene_comes_back(full):
    scene = Scene.from_mapping(full)
    again = Scene.from_canonical(scene.canonical())
    assert again == scene and again.id == scene.id
    assert again.canonical() == scene.canonical()
    assert again.mesh.stiffness.correction == (1.0, 1.1)
    assert again.operation.speed == pytest.approx(scene.operation.speed, rel=1e-11)


numbers = st.floats(1e-300, 1e300)


@given(numbers)
def test_canonical_numbers_keep_twelve_digits_and_settle(value):
    once = json.loads(canonical({"x": value}))["x"]
    assert once == pytest.approx(value, rel=1e-11)
    assert json.loads(canonical({"x": float(once)}))["x"] == once


@settings(max_examples=40, deadline=None)
@given(
    teeth=st.tuples(st.integers(12, 400), st.integers(12, 400)),
    torque=st.floats(1e-3, 1e6),
    speed=st.floats(1e-2, 1e5),
    seed=st.integers(0, 2**64),
    share=st.floats(1e-6, 10.0),
    depths=st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=4),
    model=st.sampled_from(["potential-energy", "constant"]),
    dynamic=st.booleans(),
)
def test_canonical_round_trip(
    teeth, torque, speed, seed, share, depths, model, dynamic
):
    stiffness = {"model": model} | (
        {"value": "300 N/um"} if model == "constant" else {"scale": share}
    )
    table = {
        "gears": external_pair({"teeth": teeth[0]}, {"teeth": teeth[1]}),
        "operation": {"torque": f"{torque!r} N*m", "speed": f"{speed!r} rpm"},
        "mesh": {"damping_ratio": share, "stiffness": stiffness},
        "errors": {
            "seed": seed,
            "harmonic": [{"order": 1, "amplitude": f"{d!r} um"} for d in depths],
        },
        "wear": {
            "coefficient": {
                "model": "constant",
                "value": "1e-18 m^2/N",
                "gear": {"factor": share},
            },
            "until": {"depth": "1 mm"},
            "snapshots": {"depth": [f"{d!r} um" for d in depths]},
        },
    }
    if dynamic:
        table["dynamics"] = {
            "model": "spur-3dof",
            "supports": {"pinion": SUPPORT, "gear": SUPPORT},
        }
    scene = Scene.from_mapping(table)
    again = Scene.from_canonical(scene.canonical())
    assert again.canonical() == scene.canonical() and again.id == scene.id
    assert again.errors.seed == seed


def test_big_whole_numbers_stay_exact():
    assert stored(json.loads(canonical({"seed": 2**63 + 1})))["seed"] == 2**63 + 1
