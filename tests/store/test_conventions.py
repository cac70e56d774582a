"""Conventions hold under a checker that is not ours: IOOS's, for CF
1.11 and ACDD 1.3.
"""

import made_up
import pytest
from conventions import check, complaints
from scenes import CAMPAIGNS

import wearlab as wl
from wearlab.runner.worker import Task, execute
from wearlab.store.netcdf import to_image

pytest.importorskip("compliance_checker")
BASE = CAMPAIGNS / "base"


@pytest.mark.filterwarnings("ignore")
def test_no_coordinate_has_a_filling(tmp_path):
    import netCDF4

    whole = made_up.run(800.0)
    data = whole[
        list({whole[name].dims: name for name in whole}.values())
    ]  # one of each shape: it is slow
    path = tmp_path / "run.nc"
    path.write_bytes(to_image(data)[0])
    with netCDF4.Dataset(path) as file:
        for name in map(str, data.coords):
            assert "_FillValue" not in file[name].ncattrs(), name
    assert not any(
        "_FillValue" in text
        for some in complaints(path, "cf:1.11").values()
        for text in some
    )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("base", ["spur_50_50", "internal_40_100", "planetary_ngw11"])
def test_runs_of_every_kind_of_gear_set(tmp_path, base):
    """And the export of the campaign that they are."""
    from wearlab.store.export import export

    file = tmp_path / "one.toml"
    file.write_text(
        f'extends = "{(BASE / base).as_posix()}.toml"\ndrop = ["dynamics"]\n'
    )
    try:
        campaign = wl.load(file)
    except ValueError:
        file.write_text(f'extends = "{(BASE / base).as_posix()}.toml"\n')
        campaign = wl.load(file)
    case = campaign.cases[0]
    outcome = execute(Task(case.id, case.scene))
    assert outcome.state == "done", outcome.reason
    path = tmp_path / "run.nc"
    path.write_bytes(outcome.image)
    check(path)
    store = wl.Store(tmp_path / "store")
    store.archive.create()
    with store.archive.presence() as here:
        store.archive.save([outcome], here.token)
    check(export(campaign, store, tmp_path / "out.nc"))


@pytest.mark.filterwarnings("ignore")
def test_an_export_of_sweeps_and_cases(fill, tmp_path):
    """Swept coordinates, too, say what they are."""
    from fake_campaign import sweep

    from wearlab.store.export import export

    campaign = sweep(2, static=True)
    path = export(campaign, fill(campaign), tmp_path / "out.nc")
    against = [text for some in complaints(path, "cf:1.11").values() for text in some]
    assert not [text for text in against if "speed" in text or "case" in text], against


@pytest.mark.filterwarnings("ignore")
def test_an_export_of_a_campaign_that_follows_no_paper(fill, tmp_path):
    """An attribute that is an empty text is none."""
    from dataclasses import replace

    from fake_campaign import sweep

    from wearlab.store.export import export

    campaign = replace(sweep(2), reference=None)
    path = export(campaign, fill(campaign), tmp_path / "out.nc")
    assert not [
        text
        for some in complaints(path, "cf:1.11").values()
        for text in some
        if "references" in text
    ]
