import pytest

from wearlab.campaign import CampaignError, load


def problem(write, text, name="study.toml"):
    with pytest.raises(CampaignError) as caught:
        load(write(text, name))
    (line,) = caught.value.problems
    return line


def scene(campaign):
    (case,) = campaign.cases
    return case.scene


def test_a_file_stands_for_itself(write):
    campaign = load(write('title = "x"', "empty.toml").parent / "base.toml")
    assert (
        campaign.title == "base"
        and campaign.reference is None
        and campaign.metadata == {}
    )
    assert [case.label for case in campaign.cases] == ["base"] and campaign.axes == ()
    assert scene(campaign).operation.torque == 340.0


def test_only_the_difference_is_written(study):
    one = scene(study('[operation]\ntorque = "300 N*m"'))
    assert (one.operation.torque, one.dynamics.method) == (300.0, "rk4")
    assert one.operation.speed == pytest.approx(115.19, abs=0.01)


def test_later_files_win(write):
    write('title = "one"\n[operation]\ntorque = "1 N*m"\nspeed = "1 rpm"', "one.toml")
    write('reference = "two"\n[operation]\ntorque = "2 N*m"', "two.toml")
    campaign = load(write('extends = ["base.toml", "one.toml", "two.toml"]'))
    assert (campaign.title, campaign.reference) == ("one", "two")
    assert scene(campaign).operation.torque == 2.0
    assert scene(campaign).operation.speed == pytest.approx(0.1047, abs=1e-4)


def test_paths_are_relative_to_the_file_that_writes_them(write):
    write("phase,stiffness\n0,300\n1,300\n", "data/k.csv")
    write("x,y\n", "data/points.csv")
    write(
        """
        extends = "../base.toml"
        [mesh.stiffness]
        model = "tabulated"
        file = "k.csv"
        units = { stiffness = "N/um" }
        [[figure]]
        kind = "tvms"
        published = "points.csv"
        """,
        "data/table.toml",
    )
    campaign = load(write('extends = "data/table.toml"'))
    assert scene(campaign).mesh.stiffness.stiffness == (3e8, 3e8)
    assert campaign.figures[0].published.read_text() == "x,y\n"


def test_paths_in_sweeps_and_cases_too(write):
    write("phase,stiffness\n0,300\n1,300\n", "data/a.csv")
    write("phase,stiffness\n0,200\n1,200\n", "data/b.csv")
    write(
        """
        extends = "../base.toml"
        [mesh.stiffness]
        model = "tabulated"
        file = "a.csv"
        units = { stiffness = "N/um" }
        [[sweep]]
        "mesh.stiffness.file" = ["a.csv", "b.csv"]
        labels = ["a", "b"]
        [[case]]
        label = "own"
        "mesh.stiffness.file" = "b.csv"
        """,
        "data/table.toml",
    )
    cases = load(write('extends = "data/table.toml"')).cases
    assert [case.scene.mesh.stiffness.stiffness[0] for case in cases] == [3e8, 2e8, 2e8]
    assert cases[1].id == cases[2].id


def test_changing_the_model_replaces_its_table(study):
    one = scene(
        study(
            """
            [dynamics]
            model = "spur-3dof"
            supports.pinion = { radial_stiffness = "1 N/um", damping_ratio = 0.1 }
            supports.gear = { radial_stiffness = "1 N/um", damping_ratio = 0.1 }
            """
        )
    )
    assert one.dynamics.method == "periodic"
    assert scene(study('dynamics.model = "torsional"')).dynamics.method == "rk4"


def test_alternatives_replace_each_other(study):
    one = scene(
        study('mesh.damping_ratio = 0.07\ngears.pinion.root_diameter = "140 mm"')
    )
    assert one.mesh.damping is None and one.gears.pinion.dedendum_coefficient is None


def test_drop_acts_before_the_files_own_keys(study):
    one = scene(
        study('drop = ["dynamics", "wear.coefficient"]\n[wear]\npressure = "peak"')
    )
    assert one.dynamics is None and one.wear.coefficient is None
    assert (one.wear.load.chosen, one.wear.pressure.chosen) == ("static", "peak")
    again = scene(study('drop = "dynamics"\n[dynamics]\nmodel = "torsional"'))
    assert again.dynamics.method == "periodic"


def test_a_dropped_key_regains_its_default(study):
    assert scene(study('drop = ["dynamics.method"]')).dynamics.method == "periodic"


def test_drop_does_not_reach_the_files_own_keys(write):
    line = problem(
        write,
        'extends = "base.toml"\ndrop = ["numerics"]\n[numerics]\ntolerance = 1e-4',
    )
    assert "study.toml: drop: 'numerics' is not there to be dropped" in line


@pytest.mark.parametrize(
    ("path", "near"), [("dynamic", "dynamics"), ("mesh.dampin", "mesh.damping")]
)
def test_an_unknown_path_is_not_dropped(write, path, near):
    line = problem(write, f'extends = "base.toml"\ndrop = ["{path}"]')
    assert f"drop: '{path}' is not there to be dropped, did you mean '{near}'?" in line


def test_circles_are_found(write):
    write('extends = "c.toml"', "b.toml")
    write('extends = "a.toml"', "c.toml")
    assert "a.toml → b.toml → c.toml → a.toml" in problem(
        write, 'extends = "b.toml"', "a.toml"
    )


def test_the_same_base_twice_is_no_circle(write):
    write('extends = "base.toml"\nmesh.normal_backlash = "1 um"', "b.toml")
    write('extends = "base.toml"\nnumerics.tolerance = 1e-4', "c.toml")
    one = scene(load(write('extends = ["b.toml", "c.toml"]')))
    assert one.mesh.normal_backlash == 1e-6 and one.numerics.tolerance == 1e-4


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('extends = "no.toml"', "no.toml: cannot read it: No such file"),
        ("extends = 3", "study.toml: extends: 3 is not a file or a list of files"),
        (
            'extends = "base.toml"\ndrop = [3]',
            "study.toml: drop: [3] is not a list of sections or dotted keys",
        ),
        ("title = ", "study.toml: no TOML file: "),
        (
            "[gears]\nface_width = 30 mm",
            'write a quantity with its unit in quotes: "30 mm"',
        ),
        ("gear = { teeth = 20, face_width = 30mm }", 'in quotes: "30 mm"'),
        (
            "[gears.pinion]\nprofile_shift_coefficient = 0,2",
            "write a decimal point: 0.2",
        ),
        ('title = "a"\ntitle = "b"', "study.toml: no TOML file: "),
    ],
)
def test_unreadable_files(write, text, said):
    assert said in problem(write, text)


def test_a_problem_names_the_file_that_wrote_it(write):
    write('[operation]\nspeed = "25 Hz"', "speed.toml")
    with pytest.raises(CampaignError) as caught:
        load(
            write('extends = ["base.toml", "speed.toml"]\n[operation]\ntorqe = "3 N*m"')
        )
    first, second = sorted(caught.value.problems)
    assert "speed.toml: scene.operation.speed: '25 Hz'" in first
    assert (
        "study.toml: scene.operation.torqe: unknown key, did you mean 'torque'?"
        in second
    )


def test_a_sweep_that_is_no_table_is_said_beside_what_else_is_wrong(write):
    with pytest.raises(CampaignError) as caught:
        load(write('extends = "base.toml"\nsweep = true\n[gears]\nmodule = "none"'))
    assert len(caught.value.problems) == 2
    assert any(
        "sweep: True is no list of tables" in line for line in caught.value.problems
    )


def test_a_message_names_the_file_that_replaced_a_table(write):
    write(
        '[wear]\ncoefficient = { model = "constant", value = "1e-18 m^2/N" }\n',
        "under.toml",
    )
    file = write(
        'extends = ["base.toml", "under.toml"]\n[wear]\ncoefficient = "1e-18 m^2/N"\n'
    )
    with pytest.raises(CampaignError) as refused:
        load(file)
    (line,) = [line for line in refused.value.problems if "wear.coefficient" in line]
    assert (
        line.startswith(str(file))
        and "write { model = 'constant', value = '1e-18 m^2/N' }" in line
    )
