"""The warmest place of a pair is among the results that `show` and the page tell."""

import pytest
from warm_pair import warm_pair

import wearlab as wl
from wearlab.report.key_results import key_results, table_of
from wearlab.schema import VARIABLES


def test_the_warmest_place_unworn_and_worn(tmp_path):
    scene = warm_pair(wear__until={"cycles": 5e6}, wear__snapshots=None)
    wl.run(scene, tmp_path / "store")
    store = wl.open(tmp_path / "store")
    results = key_results(store, store.archive.find(scene.id))
    warm = [one for one in results if one.variable == "tooth_temperature"]
    assert [one.column for one in warm] == [
        "max(tooth_temperature[update=0])",
        "max(tooth_temperature[update=-1])",
    ]
    heads, (row,) = table_of([results], VARIABLES)
    place = heads.index("largest temperature of the teeth unworn [degC]")
    assert float(row[place]) == pytest.approx(48.06, abs=0.01)
