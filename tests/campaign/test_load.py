import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import CampaignError, load
from wearlab.scene import parts_left_out, parts_present


def refused(study, text):
    with pytest.raises(CampaignError) as caught:
        study(text)
    return caught.value.problems


def test_texts(study):
    campaign = study(
        'title = "t"\nreference = "doi:x"\n[metadata]\nauthor = "A"\norcid = "0"'
    )
    assert (campaign.title, campaign.reference) == ("t", "doi:x")
    assert campaign.metadata == {"author": "A", "orcid": "0"}
    assert campaign.path.name == "study.toml" and campaign.path.is_absolute()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('metadata = "me"', "metadata: 'me' is no table: write [metadata]"),
        ("[metadata]\nauthor = 3", "metadata.author: 3 is no text or list: author"),
        ('figure = ["tvms"]', "figure[0]: 'tvms' is no table: write [[figure]]"),
        ("[[figure]]\nkind = 3", "figure[0].kind: 3 is no text: kind of figure"),
        (
            '[[figure]]\nkind = "tvms"\ny = 3',
            "figure[0].y: 3 is no text or list: variable along y",
        ),
        (
            '[[figure]]\nkind = "tvms"\nselect = "gear"',
            "figure[0].select: 'gear' is no table: dimension =",
        ),
    ],
)
def test_a_value_of_the_wrong_kind(study, text, said):
    (problem,) = refused(study, text)
    assert f": {said}" in problem


def test_texts_and_figures_are_no_part_of_a_run(study):
    plain = study()
    told = study(
        'title = "t"\nreference = "r"\n[metadata]\nauthor = "A"\n[[figure]]\nkind = '
        '"tvms"'
    )
    assert plain.cases[0].id == told.cases[0].id


def test_figures(study):
    (one, other) = study(
        """
        [[figure]]
        kind = "wear-profile"
        select = { flank = "pinion", case = ["base", "static"] }
        x = "diameter"
        y = ["wear_depth", "wear_rate"]
        hue = "update"
        units = { wear_depth = "nm" }
        note = "n"
        [[figure]]
        kind = "tvms"
        units = "N/mm"
        """
    ).figures
    assert one.select == {"flank": "pinion", "case": ["base", "static"]}
    assert (one.x, one.y, one.hue, one.rows) == (
        "diameter",
        ("wear_depth", "wear_rate"),
        "update",
        None,
    )
    assert (
        one.units == {"wear_depth": "nm"}
        and other.units == "N/mm"
        and other.published is None
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '[[figure]]\nselect = { flank = "pinion" }',
            "figure[0].kind: required: kind of figure",
        ),
        (
            '[[figure]]\nkind = "tvms"\ntitel = "x"',
            "figure[0].titel: unknown key, did you mean 'title'?",
        ),
        ('[[figure]]\nkind = "tvms"\nx = 3', "figure[0].x: 3"),
        (
            '[[figure]]\nkind = "tvms"\n[[figure.published]]\nfile = "points.csv"',
            "figure[0].published: [{'file'",
        ),
        (
            '[[figure]]\nkind = "tvms"\npublished = 3',
            "figure[0].published: 3 is no text or table: table of points",
        ),
        (
            '[[figure]]\nkind = "tvms"\npublished = { file = "a.csv", sidee = "left" }',
            "figure[0].published.sidee: unknown key, did you mean 'side'?",
        ),
        (
            '[[figure]]\nkind = "tvms"\npublished = { side = "left" }',
            "figure[0].published.file: required: table with columns",
        ),
        ('[figure]\nkind = "tvms"', "write [[figure]]"),
        (
            '[metadata]\nautor = "A"',
            "metadata.autor: unknown key, did you mean 'author'?",
        ),
        ("[metadata]\nauthor = 3", "metadata.author: 3"),
        ("[opration]", "opration: unknown key, did you mean 'operation'?"),
        ("[sweeps]", "sweeps: unknown key, did you mean 'sweep'?"),
        ("title = 3", "title: 3 is no text"),
        ("[exclude]", "exclude: {} is no condition"),
        ('exclude = "x"', "exclude[0]: unknown name 'x'"),
        ("[start]", "scene.start: give 'run', or 'campaign' and 'select'"),
    ],
)
def test_wrong_texts_and_figures(study, text, said):
    (line,) = refused(study, text)
    assert said in line and "study.toml: " in line


def test_all_faults_at_once(study):
    lines = refused(
        study, 'titel = "x"\n[[figure]]\n[[sweep]]\n"a.b" = []\n[mesh]\ndampin = 1'
    )
    assert [
        any(word in line for line in lines)
        for word in ("titel", "figure[0].kind", "a.b", "dampin")
    ] == [True] * 4


def test_the_published_study():
    campaign = load(CAMPAIGNS / "spur_speeds.toml")
    assert campaign.title == "Wear of a spur pair at five speeds"
    assert [(axis.name, axis.units, axis.values) for axis in campaign.axes] == [
        ("speed", "rpm", (800.0, 1100.0, 1860.0, 2200.0, 3720.0))
    ]
    assert [case.label for case in campaign.cases] == ["base"] * 5 + ["static"]
    scene = campaign.cases[1].scene
    assert scene.gears.pinion.inertia == pytest.approx(7.3e-3)
    assert scene.gears.gear.mass == 2.8 and scene.gears.gear.root_diameter == 0.14
    assert scene.gears.pinion.bore_diameter == pytest.approx(0.04)
    assert scene.dynamics.supports.pinion.radial_stiffness == 1.15e9
    assert scene.dynamics.supports.gear.damping == 5360.0
    assert scene.wear.coefficient.value == 9.65e-19 and scene.wear.coefficient.film
    assert (
        scene.wear.snapshots.cycles == (3e6, 2e7, 4e7)
        and scene.wear.until.cycles == 1e8
    )
    assert (
        scene.lubricant.viscosity == 0.012
        and scene.lubricant.pressure_viscosity == 1.6e-8
    )
    assert "dynamics" in parts_left_out(campaign.cases[5].scene)
    assert "dynamics: spur-3dof, periodic" in parts_present(scene)


WITHOUT_SCENE = ("parts/stiffness_choices.toml", "parts/extended_contact.toml")
WHOLE = [
    file
    for file in sorted(CAMPAIGNS.rglob("*.toml"))
    if file.relative_to(CAMPAIGNS).as_posix() not in WITHOUT_SCENE
]


@pytest.mark.parametrize("file", WHOLE, ids=lambda file: file.name)
def test_every_campaign_of_the_package_is_valid(file):
    assert load(file).cases
