"""Sections of a file, completed by what other sections of it say."""

from typing import Any

from pydantic import ValidationInfo

from wearlab.scene import merge, sections
from wearlab.scene.mesh import OWN_MESHES


class CompleteSections(sections.Sections):
    """The sections of one run, with what a file need not write."""

    @classmethod
    def _complete(cls, table: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        """Say which load wears, and complete each kind of mesh by what all have."""
        whole = dict(table)
        wear = table.get("wear")
        meshes = table.get("mesh")
        if isinstance(wear, dict):
            load = "static" if table.get("dynamics") is None else "instant"
            whole["wear"] = {"load": load, **wear}
        if isinstance(meshes, dict):
            general = {
                key: value for key, value in meshes.items() if key not in OWN_MESHES
            }
            of_kinds = {
                kind: merge.merge(general, meshes[kind], ("mesh", kind))
                for kind in OWN_MESHES
                if isinstance(meshes.get(kind), dict)
            }
            whole["mesh"] = {**meshes, **of_kinds}
        return whole
