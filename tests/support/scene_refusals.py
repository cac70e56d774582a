"""Refusals of scenes beyond the geometry: where they are, and scenes that raise them.

See `geometry_refusals`, which finds the refusals of gears.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from geometry_refusals import PACKAGE, RULES_OF_GEARS, Site, sites_of

from wearlab.assembly import sets, wear_checks
from wearlab.assembly.construction import build as build_model
from wearlab.assembly.sheet import sheet
from wearlab.scene import Scene

FILES = (
    PACKAGE / "scene" / "rules.py",
    PACKAGE / "scene" / "operation.py",
    PACKAGE / "scene" / "duty_file.py",
    PACKAGE / "scene" / "errors.py",
    PACKAGE / "scene" / "pitch_table.py",
    PACKAGE / "scene" / "limits.py",
    PACKAGE / "scene" / "start.py",
    PACKAGE / "scene" / "mesh.py",
    PACKAGE / "scene" / "coefficient.py",
    PACKAGE / "scene" / "thermal.py",
    PACKAGE / "thermal" / "models" / "__init__.py",
    PACKAGE / "wear" / "measured_profile.py",
    PACKAGE / "assembly" / "errors.py",
    PACKAGE / "assembly" / "heat.py",
    PACKAGE / "assembly" / "wear_checks.py",
)
NO_REFUSALS = (
    "operation.Operation.__getattribute__.1",
    "operation._of_the_set.1",
    "rules._calibrated.3",
    "rules._beyond_path.3",
    "heat.tables.1",
    "heat.tables.2",
    "heat.tables.3",
)
"""A fault of the program itself, a text that has no words of its own there, what only a
plug-in's law or load comes to, and names of tables.
"""


def scene_sites() -> list[Site]:
    """Return the refusals of scenes that are none of their gears."""
    found = [
        site
        for file in FILES
        for site in sites_of(file, lambda function: function not in RULES_OF_GEARS)
    ]
    return [site for site in found if site.name not in NO_REFUSALS]


class SceneRefusal(NamedTuple):
    """A scene that is refused, and what happens where the advice is taken.

    Parameters
    ----------
    scene : the table that is refused
    advice : by the words of the message that give it (a pattern): changes of the table
        by dotted keys, as of `geometry_refusals.Refusal`; texts of files by
        ``file:NAME``
    files : texts by the names under which they lie beside the campaign
    """

    scene: dict[str, Any]
    advice: Mapping[str, Mapping[str, Any]]
    files: Mapping[str, str] = {}


def build_scene(table: Mapping[str, Any], folder: Path) -> None:
    """Build a scene as far as a run does before its first step."""
    scene = Scene.from_mapping(table, base_directory=folder)
    sheet(scene)
    heaviest = scene.in_heaviest_condition
    gears = sets.build_set(heaviest)
    wear_checks.check_initial_wear(scene, gears)
    wear_checks.check_limits(scene, gears)
    if scene.mesh is not None:
        build_model(heaviest)
