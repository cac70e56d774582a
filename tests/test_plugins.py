"""A user's own variants: checked, cited, part of the identity, run
only where the user says so.
"""

import json
import pickle
import shutil
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from scenes import CAMPAIGNS, external_pair

import wearlab
import wearlab as wl
from wearlab.assembly import build
from wearlab.campaign import CampaignError, load
from wearlab.cli.app import status_of
from wearlab.compiled import SlowFunction
from wearlab.plugins import (
    PluginError,
    Registry,
    Trust,
    declaration,
    forget,
    trusting,
    use,
)
from wearlab.scene import Scene, SceneError
from wearlab.slots import VariantError
from wearlab.store import Store

EXAMPLES = CAMPAIGNS / "plugins"
PAIR = {
    "gears": external_pair(50, 50),
    "operation": {"torque": "340 N*m", "speed": "1100 rpm"},
}
SOURCE = """
    from typing import Annotated, Literal
    from wearlab.options import POSITIVE, Pressure, option
    from wearlab.wear.coefficients import CoefficientModel

    class Mine(CoefficientModel):
        model: Literal["{name}"] = option(
            "{name}", "k falls with pressure", source="my thesis, Eq. 3"
        )
        limit: Annotated[Pressure, POSITIVE] = option(
            "{limit}", "a pressure", source="my thesis"
        )

        def build(self, setting):
            limit = self.limit
            return lambda state: {body}
"""


@pytest.fixture
def plugin(tmp_path):
    def write(
        name="mine",
        limit="1 GPa",
        body="1e-18 * limit / (limit + state.pressure)",
        file=None,
    ):
        limit = limit if limit == "..." else float(limit.split()[0]) * 1e9
        source = textwrap.dedent(SOURCE).replace('"{limit}"', str(limit))
        path = tmp_path / (file or f"{name.replace('-', '_')}.py")
        path.write_text(source.replace("{name}", name).replace("{body}", body))
        return path

    return write


def worn(model, **options):
    return {
        **PAIR,
        "wear": {"coefficient": {"model": model, **options}, "load": "static"},
    }


def test_options_are_checked_converted_and_cited(plugin):
    use([str(plugin())])
    scene = Scene.from_mapping(worn("mine", limit="2000 N/mm^2"))
    assert scene.wear.coefficient.limit == 2e9
    with pytest.raises(SceneError, match=r"scene.wear.coefficient.limit: .*5 mm"):
        Scene.from_mapping(worn("mine", limit="5 mm"))
    with pytest.raises(SceneError, match="did you mean 'limit'"):
        Scene.from_mapping(worn("mine", limits="5 GPa"))
    from wearlab.campaign.json_schema import schema_json

    said = json.loads(schema_json())["$defs"]["Mine"]["properties"]["limit"]
    assert (said["unit"], said["source"]) == ("Pa", "my thesis")


def test_a_default_with_its_unit_is_read_when_the_plugin_is_loaded(plugin):
    """It had passed ``check`` as the text that it is, and ended in
    numba's traceback.
    """
    path = plugin(name="warm", limit="3 GPa")
    text = path.read_text()
    path.write_text(text.replace(str(3e9), '"3000 N/mm^2"'))
    use([str(path)])
    scene = Scene.from_mapping(worn("warm"))
    assert scene.wear.coefficient.limit == 3e9
    assert np.isfinite(wl.simulate(scene).wear_rate).all()
    path.write_text(text.replace(str(3e9), '"60 degC"').replace('"warm"', '"warmer"'))
    with pytest.raises(
        PluginError,
        match=r"warm.py: Mine.limit: default '60 degC': .*expected a pressure",
    ):
        use([str(path)])


def test_needs_that_no_scene_can_say_are_refused_when_loaded(plugin):
    path = plugin(name="needy")
    text = path.read_text()
    for needs, said in (
        (
            '("lambda",)',
            r"Mine.needs: 'lambda' is unknown, did you mean 'lambda_ratio'\? there are",
        ),
        ('"hardness"', r"'hardness' is no tuple: write \('hardness',\)"),
    ):
        path.write_text(
            text.replace(
                "class Mine(CoefficientModel):",
                f"class Mine(CoefficientModel):\n    needs = {needs}",
            )
        )
        with pytest.raises(PluginError, match=said):
            use([str(path)])


@pytest.mark.parametrize(
    ("attribute", "message"),
    [
        (
            'model_eror: ClassVar[str] = "20 %"',
            r"^warm.py: Mine.model_eror: wearlab reads no attribute of this name, did "
            r"you mean 'model_error'\? name what is for your own use _model_eror$",
        ),
        ("departure = property(str)", "Mine.departure: .* name; name what is"),
        ("_departure = property(str)", None),
        ('model_error: ClassVar[str] = "20 %"', None),
    ],
)
def test_an_attribute_that_nobody_reads_is_refused_by_name(plugin, attribute, message):
    path = plugin(name="warm")
    head = "class Mine(CoefficientModel):"
    text = path.read_text().replace(head, f"{head}\n    {attribute}")
    path.write_text(f"from typing import ClassVar\n{text}")
    if message is None:
        use([str(path)])
        return
    with pytest.raises(PluginError, match=message):
        use([str(path)])


def test_lambda_is_there_without_a_film_and_its_absence_is_no_number(plugin):
    path = plugin(
        name="of-film", body="1e-18 * 2.718281828 ** -state.lambda_ratio + 0.0 * limit"
    )
    text = path.read_text()
    use([str(path)])
    rough = {
        **PAIR["gears"],
        "pinion": {"teeth": 50, "roughness_ra": "0.3 um"},
        "gear": {"teeth": 50, "roughness_ra": "0.3 um"},
    }
    oil = {"viscosity": "0.012 Pa*s", "pressure_viscosity": "1.6e-8 1/Pa"}
    run = wl.simulate(
        Scene.from_mapping({**worn("of-film"), "gears": rough, "lubricant": oil})
    )
    ratio = run.lambda_ratio.values[0]
    k = run.effective_wear_coefficient.values[0]
    assert 0.0 < ratio.min() < ratio.max() < 10.0
    np.testing.assert_allclose(k, 1e-18 * 2.718281828**-ratio, rtol=1e-9)
    with pytest.raises(VariantError, match="nan"):
        wl.simulate(Scene.from_mapping(worn("of-film")))
    path.write_text(
        text.replace("class Mine(", "class Needy(")
        .replace("of-film", "of-film-too")
        .replace(
            "(CoefficientModel):", '(CoefficientModel):\n    needs = ("lambda_ratio",)'
        )
    )
    use([str(path)])
    with pytest.raises(SceneError, match="roughness_ra"):
        Scene.from_mapping({**worn("of-film-too"), "lubricant": oil})
    with pytest.raises(SceneError, match=r"needs \[lubricant\]"):
        Scene.from_mapping({**worn("of-film-too"), "gears": rough})


def test_the_source_is_part_of_the_identity(plugin):
    use([str(plugin())])
    first = Scene.from_mapping(worn("mine"))
    others = Scene.from_mapping(worn("constant", value="1e-18 m^2/N"))
    use([str(plugin(body="2e-18 + 0.0 * state.load"))])
    second = Scene.from_mapping(worn("mine"))
    same = Scene.from_mapping(others._mapping)
    assert first.id != second.id and same.id == others.id
    with pytest.raises(SceneError, match=r"another mine.py than the one"):
        Scene.from_canonical(first.canonical())
    assert Scene.from_canonical(second.canonical()).id == second.id
    use([str(plugin())])
    assert Scene.from_canonical(first.canonical()).id == first.id


def test_another_process_receives_the_source(plugin, tmp_path):
    path = plugin(name="sent")
    use([str(path)])
    scene = Scene.from_mapping(worn("sent"))
    file = tmp_path / "scene.pickle"
    file.write_bytes(pickle.dumps(scene))
    path.unlink()
    code = (
        f"import pickle; s = pickle.load(open({str(file)!r}, 'rb')); print(s.id, "
        "s.wear.coefficient.limit)"
    )
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert shown.stdout.split() == [scene.id, "1000000000.0"]


def test_a_process_without_it_says_what_is_missing(plugin, tmp_path):
    use([str(plugin(name="absent"))])
    file = tmp_path / "scene.json"
    file.write_text(Scene.from_mapping(worn("absent")).canonical())
    code = (
        "from wearlab.scene import Scene, SceneError\n"
        f"try: Scene.from_canonical(open({str(file)!r}).read())\n"
        "except SceneError as error: print(error)"
    )
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert "'absent' comes from the plug-in absent.py (sha256" in shown.stdout
    assert "not loaded" in shown.stdout


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("1 +", "SyntaxError"),
        ("x = 1", "defines no variant, a class of"),
        ("1 / 0", "ZeroDivisionError"),
        (
            textwrap.dedent(SOURCE).replace("{name}", "constant"),
            "model 'constant' is there already",
        ),
    ],
)
def test_a_plugin_that_cannot_be_used_is_refused(tmp_path, source, said):
    path = tmp_path / "wrong.py"
    path.write_text(source.replace('"{limit}"', "1e9").replace("{body}", "0.0"))
    with pytest.raises(PluginError, match=f"wrong.py: .*{said}"):
        use([str(path)])
    assert not [
        name
        for name in sys.modules
        if name.startswith("wearlab_plugin") and "wrong" in name
    ]
    with pytest.raises(PluginError, match=r"absent.py: cannot read it"):
        use([str(tmp_path / "absent.py")])


def test_a_campaign_from_a_stranger_runs_no_code(tmp_path):
    (tmp_path / "evil.py").write_text("raise RuntimeError('was run')")
    (tmp_path / "file.toml").write_text('plugins = ["evil.py"]\n')
    with (
        trusting(Trust(runs=False)),
        pytest.raises(CampaignError, match="look at it, then add --plugins"),
    ):
        load(tmp_path / "file.toml")
    with pytest.raises(CampaignError, match="was run"):
        load(tmp_path / "file.toml")


def test_an_entry_point_is_found_and_not_run_untold(tmp_path, monkeypatch):
    package = tmp_path / "my_wear"
    package.mkdir()
    (package / "__init__.py").write_text("raise RuntimeError('imported')")
    shutil.copy(EXAMPLES / "running_in.py", package / "laws.py")
    monkeypatch.syspath_prepend(tmp_path)
    installed = tmp_path / "my_wear-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Name: my-wear\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text(
        "[wearlab.variants]\nmy-wear = my_wear.laws\n"
    )
    with (
        trusting(Trust(runs=False)),
        pytest.raises(PluginError, match="my-wear is Python code"),
    ):
        use(["my-wear"])
    law = (package / "laws.py").read_text()
    (package / "laws.py").write_text(law.replace('"running-in"', '"of-package"'))
    assert use(["my-wear"])[0].module == "my_wear.laws"
    table = worn("constant", value="1e-18 m^2/N")
    table["wear"]["law"] = "of-package"
    assert Scene.from_mapping(table).plugins_used()[0].name == "my-wear"
    with pytest.raises(PluginError, match="no Python file and no entry point"):
        use(["other"])


def run_of(file, store):
    campaign = load(EXAMPLES / file)
    report = wearlab.run(campaign, store, workers=1, progress=False)
    assert report.ok
    return campaign, store.open(campaign)


def test_plans_and_pages_of_stored_runs_need_no_code(tmp_path, capsys, monkeypatch):
    store = Store(tmp_path / "store")
    campaign, _ = run_of("running_in.toml", store)
    (record,) = (tmp_path / "store" / "plugins").iterdir()
    assert json.loads(record.read_text()) == declaration(campaign.plugins[0])
    monkeypatch.setenv("WEARLAB_STORE", str(store.path))
    file = str(EXAMPLES / "running_in.toml")
    code = (
        "from wearlab.cli.app import status_of; import sys; "
        "sys.exit(status_of(sys.argv[1:]))"
    )

    def command(*words):
        return subprocess.run(
            [sys.executable, "-c", code, *words], capture_output=True, text=True
        )

    planned = command("plan", file)
    assert planned.returncode == 0 and "nothing to do" in planned.stdout
    assert command("ls").returncode == 0
    assert command("verify").returncode == 0
    again = command("run", file)
    assert again.returncode == 0 and "0 computed" in again.stdout
    refused = command("run", file, "--recompute", "all")
    assert refused.returncode == 2 and "add --plugins" in refused.stderr


def test_a_step_of_ones_own_converges_with_its_order(tmp_path):
    """Half the step leaves a quarter of the error: of the depth after 10 million
    cycles, against 1e-6.
    """
    base = load(EXAMPLES / "heun_steps.toml").cases[0].scene

    def depth(**step):
        scene = base.replace({"wear.until": {"cycles": 1e7}, **step})
        return float(wearlab.simulate(scene).max_wear_depth.sel(flank="pinion")[-1])

    exact = depth(**{"numerics.tolerance": 1e-6, "wear.step": {"method": "adaptive"}})
    coarse, fine = (
        abs(depth(**{"wear.step": {"method": "heun", "threshold": size}}) - exact)
        for size in ("0.4 um", "0.2 um")
    )
    assert 3.0 < coarse / fine < 5.0


def test_a_law_of_ones_own_runs_in(tmp_path):
    """Depth with running-in: h + h0·(r − 1)(1 − …) grows as Archard's after it, r times
    as fast at first.
    """
    _, grid = run_of("running_in.toml", Store(tmp_path / "store"))
    rate = (
        grid.wear_rate.sel(flank="pinion")
        .squeeze()
        .transpose("update", "profile")
        .values
    )
    depth = (
        grid.wear_depth.sel(flank="pinion")
        .squeeze()
        .transpose("update", "profile")
        .values
    )
    force = (
        grid.tooth_force.sel(flank="pinion")
        .squeeze()
        .transpose("update", "profile")
        .values
    )
    worn = rate[-1] > 0
    per_force = rate[:, worn] / force[:, worn]
    archard = per_force[0] / 5.0
    expected = archard * (1.0 + 4.0 * np.exp(-depth[:, worn] / 1e-6))
    np.testing.assert_allclose(per_force, expected, rtol=1e-9)


def test_a_function_that_numba_cannot_compile_runs_with_a_warning(plugin):
    use(
        [
            str(
                plugin(
                    name="slow",
                    body="__import__('math').fsum([1e-18]) + 0.0 * state.load",
                )
            )
        ]
    )
    with pytest.warns(SlowFunction, match=r"slow.py: 'slow' runs as plain Python"):
        run = wearlab.simulate(Scene.from_mapping(worn("slow")))
    fast = wearlab.simulate(Scene.from_mapping(worn("constant", value="1e-18 m^2/N")))
    np.testing.assert_allclose(run.wear_rate, fast.wear_rate, rtol=1e-12)


def test_a_coefficient_over_pressure_is_what_it_says(tmp_path):
    _, grid = run_of("pressure_coefficient.toml", Store(tmp_path / "store"))
    p = grid.contact_pressure.values
    k = grid.effective_wear_coefficient.values
    np.testing.assert_allclose(k, 1e-19 + 9e-19 * p**8 / (p**8 + 450e6**8), rtol=1e-9)


def test_a_film_of_ones_own_is_what_it_says(tmp_path):
    _, grid = run_of("film_share.toml", Store(tmp_path / "store"))
    ratio = grid.lambda_ratio.values
    share = grid.effective_wear_coefficient / 1e-18
    names = list(grid.case.values)
    own = share[names.index("smooth")].values
    standard = share[names.index("ding-kahraman")].values
    np.testing.assert_allclose(
        own, 1.0 / (1.0 + (ratio[names.index("smooth")] / 0.8) ** 3), rtol=1e-9
    )
    np.testing.assert_allclose(
        standard,
        np.clip(2 / 7 * (4 - ratio[names.index("ding-kahraman")]), 0, 1),
        rtol=1e-9,
    )


def test_a_coordinate_more_changes_what_it_should():
    """A stiff shaft with a light motor leaves the pair alone.

    A soft one turns two masses at each other.
    """
    pair, stiff, soft = (
        wearlab.simulate(case.scene)
        for label in ("pair alone", "stiff and light", "driveline")
        for case in load(EXAMPLES / "driveline.toml").cases
        if case.label == label
    )
    for name in ("dynamic_mesh_force", "dynamic_transmission_error"):
        np.testing.assert_allclose(stiff[name].max(), pair[name].max(), rtol=1e-3)
    parts = build(load(EXAMPLES / "driveline.toml").cases[0].scene)
    system = parts.vibration.system
    motor, pinion, gear = np.diag(system.mass)
    shaft = system.stiffness[0, 0]
    slow = np.sqrt(shaft * (1.0 / motor + 1.0 / (pinion + gear))) / (2 * np.pi)
    assert soft.natural_frequency.values.ravel()[1] == pytest.approx(slow, rel=0.01)
    mean = [float(one.dynamic_mesh_force.mean()) for one in (soft, pair)]
    assert mean[0] == pytest.approx(mean[1], rel=1e-4)


def test_a_stiffness_of_ones_own_is_what_it_says():
    """Pairs in the path share the load as their stiffnesses: the mesh
    is as stiff as their sum.
    """
    (case,) = load(EXAMPLES / "parabolic_stiffness.toml").cases
    run = wearlab.simulate(case.scene).isel(update=0, mesh=0)
    pair = build(case.scene).kinds[0].pair
    first = run.phase.values * pair.base_pitch
    sums = np.zeros(len(first))
    for ahead in (0.0, pair.base_pitch):
        along = 2.0 * (first + ahead) / (pair.path.E - pair.path.A) - 1.0
        sums += np.where(along <= 1.0, 300e6 * (1.0 - 0.45 * along**2), 0.0)
    away = np.abs(run.phase.values - pair.contact_ratio % 1.0) > 0.01
    np.testing.assert_allclose(run.mesh_stiffness.values[away], sums[away], rtol=1e-4)


def test_the_schema_tells_the_options_of_a_files_own_variants(
    tmp_path, capsys, monkeypatch
):
    """From the command line: whole with FILE, alone with ``--added``.

    No code is run untold.
    """
    file = EXAMPLES / "pressure_coefficient.toml"
    extending = tmp_path / "extending.toml"
    extending.write_text(f'extends = "{file.as_posix()}"\n')

    def said(*words):
        status = status_of(["schema", *map(str, words)])
        told = capsys.readouterr()
        return status, told.out if status == 0 else told.err

    for named in (file, extending):
        forget()
        status, refused = said(named, "--added")
        assert (
            status == 2
            and "pressure_coefficient.py is Python code that would be run" in refused
        )
        assert "mild-to-severe" not in said()[1]
        whole = json.loads(said(named, "--plugins")[1])
        added = json.loads(said(named, "--added", "--plugins")[1])["wear.coefficient"][
            "mild-to-severe"
        ]
        assert added["properties"]["transition"]["unit"] == "Pa"
        assert (
            added["properties"]["transition"]["description"]
            == "pressure p_0 halfway between both"
        )
        assert added["properties"]["steepness"]["default"] == 8.0
        assert added["required"] == ["mild", "severe", "transition"]
        assert whole["$defs"]["MildToSevere"]["properties"] == added["properties"]
    (kept := tmp_path / "store" / "plugins").mkdir(parents=True)
    (plugin,) = use([str(file.with_suffix(".py"))])
    whole = declaration(plugin)
    for registry in Registry.all.values():
        # as of a registry whose module was imported after the plug-in ran
        registry.by_plugin.pop(plugin.sha256, None)
    assert declaration(plugin) == whole
    (kept / f"{plugin.sha256}.json").write_text(json.dumps(whole))
    forget()
    monkeypatch.setenv("WEARLAB_STORE", str(kept.parent))
    unread = json.loads(said(file, "--added")[1])["wear.coefficient"]["mild-to-severe"]
    assert (
        unread["properties"]["transition"].items()
        <= added["properties"]["transition"].items()
    )
    assert unread["properties"]["transition"]["unit"] == "Pa"
    assert said("--added") == (
        2,
        "wearlab: --added needs a campaign FILE that names plug-ins\n",
    )
    assert said(tmp_path / "none.toml")[0] == 2
