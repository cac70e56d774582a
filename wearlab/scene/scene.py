"""A scene: all sections of one run, typed, frozen and in SI."""

import dataclasses
import json
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, ClassVar

from pydantic import ValidationError

from wearlab import options, plugins, tables
from wearlab.scene import identity, merge, problems, rules
from wearlab.scene.completion import CompleteSections
from wearlab.scene.duty_file import ranges_told
from wearlab.scene.errors import ErrorsSection
from wearlab.scene.gears import Gears, kind_of
from wearlab.scene.materials import Lubricant
from wearlab.scene.mesh import MeshSection, OneMesh
from wearlab.scene.operation import Dynamics, Operation
from wearlab.scene.sections import (
    Numerics,
    Rating,
    Sections,
    StoreSection,
    parts_within,
)
from wearlab.scene.start import Start, StartWear
from wearlab.scene.wear import WearSection
from wearlab.tables.written import table_named
from wearlab.thermal.models import ThermalModel
from wearlab.wear.coefficients.calibrated import CalibrationLife

RESOLVED = ("operation", "lubricant")
"""Sections that put what follows from their options beside these: they are always read
anew."""


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """The sections of a campaign file for one run, checked against each other.

    Made by `from_mapping`, `from_canonical` or `replace`. Values are SI: angles in rad,
    speeds in rad/s. Two scenes are equal when they have the same canonical form.

    Parameters
    ----------
    sections : all sections, read and checked
    """

    _model: ClassVar[type[Sections]] = CompleteSections

    sections: Sections
    _mapping: dict[str, Any] = field(default_factory=dict)
    _base: Path | None = None
    _parts: dict[str, options.Part] = field(default_factory=dict)
    _texts: identity.Texts = field(default_factory=dict)
    _start_wear: StartWear | None = None
    _calibration: CalibrationLife | None = None

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
        context = {"base_directory": base, "kind": kind_of(raw)}
        try:
            whole = cls._model.model_validate({**raw, **sections_read}, context=context)
        except ValidationError as error:
            raise problems.SceneError(problems.problems_of(error)) from None
        if broken := rules.broken_rules(whole):
            raise problems.SceneError(broken)

        parts = {
            name: part
            for name, part in whole
            if name in raw and name not in RESOLVED and isinstance(part, options.Part)
        }
        return cls(whole, raw, base, parts)

    @property
    def gears(self) -> Gears:
        """Shape of the gears."""
        return self.sections.gears

    @property
    def operation(self) -> Operation:
        """How they are driven."""
        return self.sections.operation

    @property
    def mesh(self) -> MeshSection:
        """Contact, stiffness, excitation and damping."""
        return self.sections.mesh

    @property
    def errors(self) -> ErrorsSection | None:
        """Prescribed errors, None where there are none."""
        return self.sections.errors

    @property
    def dynamics(self) -> Dynamics | None:
        """Moving coordinates, None of quasi-static gears."""
        return self.sections.dynamics

    @property
    def lubricant(self) -> Lubricant | None:
        """The oil, None of dry flanks."""
        return self.sections.lubricant

    @property
    def wear(self) -> WearSection | None:
        """The wear law and the life, None of one unworn state."""
        return self.sections.wear

    @property
    def thermal(self) -> ThermalModel | None:
        """How warm friction makes the teeth, None where it does not count."""
        return self.sections.thermal

    @property
    def numerics(self) -> Numerics:
        """Accuracy."""
        return self.sections.numerics

    @property
    def start(self) -> Start | None:
        """The run whose wear this one goes on from, None without one."""
        return self.sections.start

    @property
    def rating(self) -> Rating | None:
        """What ISO 6336 is asked of the pair, None where nothing is rated."""
        return self.sections.rating

    @property
    def store(self) -> StoreSection:
        """What is kept of the run."""
        return self.sections.store

    @property
    def meshes(self) -> dict[str, OneMesh]:
        """What holds for each kind of mesh, by the path of its table."""
        return self.sections.meshes

    @property
    def coefficients(self) -> dict[str, Any]:
        """The wear coefficient of each member with teeth, {} where nothing wears."""
        return self.sections.coefficients

    @property
    def prescribed(self) -> ErrorsSection:
        """The prescribed errors; those of a scene without ``[errors]`` are zero."""
        return self.sections.prescribed

    @property
    def face_keys(self) -> tuple[str, ...]:
        """The keys by which the flanks have a width, () where they have none."""
        return self.sections.face_keys

    def initial_of(self, flank: str) -> Any:
        """Return the wear that a flank starts with, None of a new one.

        Parameters
        ----------
        flank : its name, such as ``"pinion"``
        """
        return self.sections.initial_of(flank)

    def hands(self) -> dict[str, str]:
        """Return the hand of each helical gear: as stated, or as its mate requires."""
        return self.sections.hands()

    @property
    def duty_table(self) -> tables.ReadTable | None:
        """The file of the duty as it was understood, None where there is none."""
        operation = self._mapping.get("operation")
        duty = operation.get("duty") if isinstance(operation, Mapping) else None
        if not isinstance(duty, Mapping):
            return None
        try:
            return table_named(duty, self._base)
        except tables.TableError:  # moved or changed since
            return None

    @property
    def duty_ranges(self) -> tuple[str, ...]:
        """What torque or speed of the duty is the middle of a range, a line each."""
        operation = self._mapping.get("operation")
        duty = operation.get("duty") if isinstance(operation, Mapping) else None
        try:
            return ranges_told(duty, self.duty_table)
        except tables.TableError:  # changed since
            return ()

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
        return dataclasses.replace(scene, _texts=dict(self._texts))

    def with_sections(self, **changed: options.Part | None) -> "Scene":
        """Return a scene in which whole sections are others, as they are.

        Nothing is read or checked: `replace` is for what a campaign file writes.

        Parameters
        ----------
        changed : sections by name
        """
        return dataclasses.replace(
            self, sections=self.sections.model_copy(update=changed)
        )

    def in_conditions(self) -> tuple["Scene", ...]:
        """Return the scene in each of its conditions of operation.

        Of a single one it is the scene itself.
        """
        if not self.operation.several:
            return (self,)
        return tuple(
            self.with_sections(operation=condition)
            for condition in self.operation.in_conditions()
        )

    def in_front(self) -> "Scene":
        """Return the scene in one condition as if its front flanks were loaded."""
        operation = self.operation
        return self.with_sections(
            operation=operation.single_condition(
                operation.torque, operation.speed, operation.largest_torque
            )
        )

    @property
    def in_heaviest_condition(self) -> "Scene":
        """The scene in its condition of the largest torque, itself of a single one."""
        if not self.operation.several:
            return self
        return self.with_sections(operation=self.operation.heaviest_condition())

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
        return dataclasses.replace(self, _start_wear=wear)

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
        return dataclasses.replace(self, _calibration=life)

    def canonical(self) -> str:
        """Return the canonical JSON: defaults filled in, SI, 12 significant digits."""
        return self._canonical

    @cached_property
    def id(self) -> str:
        """The identity of the run: a hash of model version and what is not default."""
        return identity.identity(self.sections, self._texts)

    @cached_property
    def _canonical(self) -> str:
        return identity.canonical(self.sections.model_dump())

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
        return hash(self._canonical)

    def plugins_used(self) -> tuple[plugins.Plugin, ...]:
        """Return the plug-ins whose variants this scene has chosen.

        Raises
        ------
        PluginError
            When only what they declare is known here.
        """
        origins = dict.fromkeys(
            part.origin
            for part in parts_within(self.sections)
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
    vars(scene).update(state)
    return scene
