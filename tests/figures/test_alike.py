"""Curves that repeat themselves along meshes are drawn once, and it is said."""

from dataclasses import replace

import numpy as np

from wearlab.campaign.campaign import FigureSpec
from wearlab.figures.curves import without_repeats
from wearlab.figures.kind import read
from wearlab.figures.plot import Scale, Series
from wearlab.figures.wording import Label

X = np.linspace(0.0, 1.0, 50)
ASK = read(FigureSpec(kind="tvms"), 1, None)


def curve(mesh, y, state="unworn"):
    key = {"mesh": Label(mesh, mesh), "update": Label(state, state)}
    return Series(key, X, y, Scale("phase", "1"), Scale("stiffness", "N/m"))


def meshes(series):
    return [one.key["mesh"].text for one in series]


def test_alike_meshes_are_drawn_once_and_the_others_named():
    names = ("sun-planet-1", "sun-planet-2", "planet-ring-1", "planet-ring-2")
    found, notes = without_repeats(
        [curve(name, X + (i > 1)) for i, name in enumerate(names)], ASK
    )
    assert meshes(found) == ["sun-planet-1", "planet-ring-1"]
    assert notes == [
        "The same, drawn once as sun-planet-1: sun-planet-2.",
        "The same, drawn once as planet-ring-1: planet-ring-2.",
    ]


def test_a_mesh_that_differs_in_one_state_only_is_drawn():
    worn = [curve("a", X, "worn"), curve("b", X + 0.01 * (X > 0.5), "worn")]
    found, notes = without_repeats([curve("a", X), curve("b", X), *worn], ASK)
    assert meshes(found) == ["a", "b", "a", "b"] and not notes


def test_what_the_figure_names_is_drawn_as_asked():
    found, notes = without_repeats(
        [curve("a", X), curve("b", X)], replace(ASK, cols="mesh")
    )
    assert len(found) == 2 and not notes
