"""A scene: all sections of one run, typed, frozen and in SI."""

import json
import pickle
from collections.abc import Mapping
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, cast

from pydantic import PrivateAttr, ValidationError, ValidationInfo

from wearlab import options, plugins, tables
from wearlab.scene import gears, identity, merge, problems, rules, sections
from wearlab.scene.mesh import OWN_MESHES
from wearlab.scene.start import StartWear
from wearlab.wear.coefficients.calibrated import CalibrationLife

RESOLVED = ("operation", "lubricant")
"""Sections that put what follows from their options beside these: they are always read
anew."""


class Scene(sections.Sections):
    """The sections of a campaign file for one run, checked against each other.

    Made by `from_mapping`, `from_canonical` or `replace`. Values are SI: angles in rad,
    speeds in rad/s. Two scenes are equal when they have the same canonical form.
    """

    _mapping: dict[str, Any] = PrivateAttr(default_factory=dict)
    _base: Path | None = PrivateAttr(default=None)
    _parts: dict[str, options.Part] = PrivateAttr(default_factory=dict)
    _texts: identity.Texts = PrivateAttr(default_factory=dict)
    _start_wear: StartWear | None = PrivateAttr(default=None)
    _calibration: CalibrationLife | None = PrivateAttr(default=None)

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

    @classmethod
    def from_mapping(
        cls, mapping: Mapping[str, Any], base_directory: str | Path | None = None
    ) -> "Scene":
        """Return the scene of a table as a campaign file writes it.

        Parameters
        ----------
        mapping : sections, quantities with their units
        base_directory : folder that relative paths start from

        Raises
        ------
        SceneError
            With every problem, one line each.
        """
        return cls._read(
            dict(mapping), None if base_directory is None else Path(base_directory), {}
        )

    @classmethod
    def _read(
        cls, raw: dict[str, Any], base: Path | None, sections_read: Mapping[str, Any]
    ) -> "Scene":
        """Return the scene of a table of which some sections have been read before."""
        try:
            context = {"base_directory": base, "kind": gears.kind_of(raw)}
            scene = cls.model_validate({**raw, **sections_read}, context=context)
        except ValidationError as error:
            raise problems.SceneError(problems.problems_of(error)) from None
        if broken := rules.broken_rules(scene):
            raise problems.SceneError(broken)
        scene._mapping, scene._base = raw, base
        stated = (
            (name, part) for name, part in scene if name in raw and name not in RESOLVED
        )
        scene._parts = {
            name: part for name, part in stated if isinstance(part, options.Part)
        }
        return scene

    @property
    def duty_table(self) -> tables.ReadTable | None:
        """The file of the duty as it was understood, None where there is none."""
        operation = self._mapping.get("operation")
        duty = operation.get("duty") if isinstance(operation, Mapping) else None
        if not isinstance(duty, Mapping):
            return None
        try:
            return tables.read_table(
                Path(duty["file"]) if self._base is None else self._base / duty["file"]
            )
        except tables.TableError:  # moved or changed since
            return None

    @classmethod
    def from_canonical(cls, text: str) -> "Scene":
        """Return the scene that a dataset stores as canonical JSON.

        Parameters
        ----------
        text : as of `canonical`
        """
        return cls.from_mapping(identity.stored(json.loads(text)))

    def replace(self, key: str | Mapping[str, Any], value: Any = None) -> "Scene":
        """Return a scene in which some options differ.

        Other models and alternatives make way.

        Parameters
        ----------
        key : dotted key, such as ``"operation.torque"``; or several with their values,
            changed together: what lies between, such as gears of which only one has its
            new teeth, need not be a valid scene
        value : as a campaign file writes it; ``None`` takes the option back to its
            default

        Raises
        ------
        SceneError
            When the result is no valid scene.

        Examples
        --------
        >>> import wearlab as wl
        >>> pair = wl.Scene.from_mapping({
        ...     "gears": {
        ...         "kind": "external-pair", "module": "3 mm", "face_width": "20 mm",
        ...         "pinion": {"teeth": 25}, "gear": {"teeth": 30},
        ...     },
        ...     "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
        ... })
        >>> changes = {"operation.torque": "80 N*m", "gears.gear.teeth": 31}
        >>> pair.replace(changes).operation.torque
        80.0
        """
        changed = self._mapping
        for name, new in (key if isinstance(key, Mapping) else {key: value}).items():
            if new is not None:
                changed = merge.merge(changed, merge.nested(name, new))
                continue
            try:
                changed = merge.without(changed, name)
            except merge.DropError as error:
                raise problems.SceneError(f"scene.{name}: {error}") from None
        # another kind of gears or of motion may mean something else of all other
        # sections
        same_kinds = all(
            changed.get(name) is self._mapping.get(name)
            for name in ("gears", "dynamics")
        )
        sections_kept = {
            name: part
            for name, part in self._parts.items()
            if same_kinds and changed.get(name) is self._mapping[name]
        }
        scene = type(self)._read(changed, self._base, sections_kept)
        scene._texts = dict(self._texts)
        return scene

    @property
    def start_wear(self) -> StartWear | None:
        """The wear that the run starts from, read from the run that it continues."""
        return self._start_wear

    def with_start_wear(self, wear: StartWear) -> "Scene":
        """Return the same scene with the wear of the run that it continues at hand.

        Parameters
        ----------
        wear : of that run, at the cycle where this one begins
        """
        scene = self.model_copy()
        scene._start_wear = wear
        return scene

    @property
    def calibration(self) -> CalibrationLife | None:
        """The life that calibrates the wear coefficient, once its run was read."""
        return self._calibration

    def with_calibration(self, life: CalibrationLife) -> "Scene":
        """Return the same scene with the life that calibrates its coefficient at hand.

        Parameters
        ----------
        life : as a run of the scene of `calibrating` had it
        """
        scene = self.model_copy()
        scene._calibration = life
        return scene

    def canonical(self) -> str:
        """Return the canonical JSON: defaults filled in, SI, 12 significant digits."""
        return self._canonical

    @cached_property
    def id(self) -> str:
        """The identity of the run: a hash of model version and what is not default."""
        return identity.identity(self, self._texts)

    @cached_property
    def _canonical(self) -> str:
        return identity.canonical(self.model_dump())

    def __repr__(self) -> str:
        """Return gears and teeth, torque and speed as written, motion and wear."""
        teeth = " × ".join(str(gear.teeth) for gear in self.gears.gears().values())
        operation = self._mapping.get("operation", {})
        driven = [
            str(operation[key])
            for key in ("torque", "power", "speed")
            if key in operation
        ]
        motion = "quasi-static" if self.dynamics is None else self.dynamics.chosen
        wear = "no wear" if self.wear is None else f"{self.wear.load.chosen} wear"
        description = ", ".join([f"{self.gears.kind} {teeth}", *driven, motion, wear])
        return f"<Scene {self.id[:10]}: {description}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Return the scene in one line, above a table of all options of its file."""
        cells = [
            (escape(key), escape(str(value)))
            for key, value in merge.leaves(self._mapping)
        ]
        rows = "".join(
            f"<tr><td>{key}</td><td>{value}</td></tr>" for key, value in cells
        )
        return f"<p><b>{escape(repr(self)[1:-1])}</b></p><table>{rows}</table>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self._canonical == other._canonical

    def __hash__(self) -> int:
        return hash(cast(str, self._canonical))

    def plugins_used(self) -> tuple[plugins.Plugin, ...]:
        """Return the plug-ins whose variants this scene has chosen.

        Raises
        ------
        PluginError
            When only what they declare is known here.
        """
        origins = dict.fromkeys(
            part.origin
            for part in sections.parts_within(self)
            if part.origin is not None
        )
        for origin in origins:
            if not origin.runs:
                raise plugins.PluginError(
                    f"{origin.file} was not run, only its options are known: add "
                    f"{plugins.CONSENT}"
                )
        for name, sha256 in self.store.results.items():
            if sha256 not in plugins.LOADED:
                raise plugins.PluginError(
                    f"the plug-in of {name!r} was not run, or is another one now: add "
                    f"{plugins.CONSENT}"
                )
        sources = dict.fromkeys(
            [*(origin.sha256 for origin in origins), *self.store.results.values()]
        )
        return tuple(plugins.LOADED[sha256] for sha256 in sources)

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Take the sources of plug-ins along to other processes."""
        plain = super().__reduce_ex__(protocol)
        used = self.plugins_used()
        return (_revived, (used, pickle.dumps(plain, protocol))) if used else plain


def _revived(used: tuple[plugins.Plugin, ...], pickled: bytes) -> Scene:
    """Return a pickled scene after its plug-ins were run in this process."""
    for plugin in used:
        plugins.bring(plugin)
    make, arguments, state = pickle.loads(pickled)[:3]
    scene: Scene = make(*arguments)
    scene.__setstate__(state)
    return scene
