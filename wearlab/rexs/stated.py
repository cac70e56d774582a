"""Which keys a study stated before it was written as REXS; others are left to defaults.

A file of another program says nothing of the kind, and then every key stays.
"""

from wearlab.rexs.document import Component, Document
from wearlab.rexs.draft import Draft
from wearlab.rexs.pairs import Roles
from wearlab.rexs.quantities import text

STATED = "custom_wearlab_stated_keys"
"""Attribute with the names of the keys that the study states, in a line."""
LOADS = ("torque", "speed", "duty")
"""Never left out: another program may have given the study load cases since."""


def keep_stated(
    draft: Draft, document: Document, stage: Component, roles: Roles
) -> None:
    """Take out of a draft what the study had left to its defaults.

    Parameters
    ----------
    draft : the campaign file
    document : the file
    stage : the stage's component
    roles : which gear is which member
    """
    _move_material(draft, document, stage, roles)
    _keep(draft, "gears", stage)
    for member, number in roles.items():
        _keep(draft, f"gears.{member}", document.components.get(number))
    for unit in document.of_type("gear_unit"):
        _keep(draft, "operation", unit)


def stated_keys(component: Component | None) -> set[str] | None:
    """Return the keys that a study states, None in a file of another program.

    Parameters
    ----------
    component : of a gear, a stage or the gear unit
    """
    line = text(component, STATED)
    return None if line is None else set(line.split())


def _keep(draft: Draft, section: str, component: Component | None) -> None:
    """Take out of a section what the study does not state."""
    stated = stated_keys(component)
    if stated is None or section not in draft.entries:
        return
    entries = draft.entries[section]
    draft.entries[section] = {
        key: entry
        for key, entry in entries.items()
        if key in stated or (section == "operation" and key in LOADS)
    }


def _move_material(
    draft: Draft, document: Document, stage: Component, roles: Roles
) -> None:
    """Write the set's material where the study states it for the set."""
    if "material" not in (stated_keys(stage) or ()):
        return
    for member, number in roles.items():
        stated = stated_keys(document.components.get(number))
        entry = draft.entries.get(f"gears.{member}", {}).get("material")
        if stated is not None and "material" not in stated and entry is not None:
            draft.put("gears", "material", entry.value, entry.comment)
            return
