"""``[operation]``: torque, speed and roles of members, duty and stages.

``[dynamics]``: which model.
"""

import math
from typing import Annotated, Any, Literal

import pydantic
from pydantic_core import CoreSchema, PydanticCustomError

from wearlab import options, units
from wearlab.dynamics.models import DynamicModel
from wearlab.scene.duty_file import NEAR_ONE, duty_blocks, middle_of
from wearlab.scene.gears import set_in

SUM_OF_SHARES = 1e-6
"""How far shares may be from 1 in sum and are taken as they are written."""
OF_ONE_CONDITION = ("torque", "speed", "power")
"""Options that several conditions have each of their own."""


BACK = "-back"
"""What names of flanks end in that only reversed torque loads."""


def back_of(flank: str) -> str:
    """Return the name of the other flank of the same teeth.

    >>> back_of("pinion")
    'pinion-back'
    """
    return f"{flank}{BACK}"


class SeveralConditions(TypeError):
    """One torque, speed or power was asked of an operation that has several."""


Side = Literal["front", "back"]
"""Which flanks of teeth that are loaded on either side carry the load."""


class _OrRange:
    """Tells the JSON Schema that a range of two values may stand for a value."""

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: pydantic.GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe a value, or a list of two."""
        value = handler(core)
        two = {"type": "array", "items": value, "minItems": 2, "maxItems": 2}
        return {"anyOf": [value, two]}


def _middle(quantity: str) -> pydantic.BeforeValidator:
    """Return what reads the middle of a range such as ``["1000 rpm", "1200 rpm"]``."""

    def read(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            return value
        if len(value) != 2:
            raise ValueError(f"{value!r} is no range: give two values, or one")
        low, high = (units.quantity(end, quantity) for end in value)
        try:
            return options.Stored(middle_of(low, high))
        except ValueError as error:
            raise ValueError(f"{value[0]} to {value[1]}: {error}") from None

    return pydantic.BeforeValidator(read)


class DutyBlock(options.Part):
    """One condition of a duty."""

    alternatives = ((("share",), ("hours",), ("cycles",)),)

    torque: Annotated[options.Torque, _middle("torque"), _OrRange()]
    """torque on the input member, or its range, of which the middle counts; negative
    loads the back flanks, 0 wears nothing"""
    speed: Annotated[
        options.Speed, _middle("speed"), _OrRange(), pydantic.AfterValidator(abs)
    ]
    """speed of the input member, in either sense, or its range, of which the middle
    counts; 0 is standstill"""
    share: Annotated[options.Number, options.POSITIVE] = options.option(None)
    """share of the operating time; all shares sum to 1, within 1 % [by hours or
    cycles]"""
    hours: Annotated[options.Hours, options.POSITIVE] | None = options.option(
        None, identity=False
    )
    """operating hours, in place of share, in proportion to their sum [by share or
    cycles]"""
    cycles: Annotated[options.Number, options.POSITIVE] | None = options.option(
        None, identity=False
    )
    """revolutions of the input member, in place of share: their time goes by the speed
    [by share or hours]"""

    def _check(self) -> None:
        if self.time_key is None:
            raise ValueError("its time is missing: give 'share', 'hours' or 'cycles'")

    @property
    def time_key(self) -> str | None:
        """The option that tells its time, None where none does."""
        keys = ("share", "hours", "cycles")
        return next((key for key in keys if getattr(self, key) is not None), None)

    @property
    def time(self) -> float:
        """Its time, in proportion to that of other conditions of the same option."""
        if self.cycles is not None:
            return self.cycles / self.speed
        return self.share if self.hours is None else self.hours

    @property
    def is_loaded(self) -> bool:
        """Whether it wears flanks: others are idle, or at rest."""
        return self.torque != 0.0 and self.speed > 0.0

    @property
    def side(self) -> Side:
        """The flanks that it loads."""
        return "back" if self.torque < 0.0 else "front"


class DutyFile(options.Part):
    """A load-duration table; its contents, not its path, are part of the scene."""

    file: str
    """table with a row for each condition: text, or a workbook"""
    sheet: str | None = None
    """sheet of a workbook [the only one that holds a table]"""
    decimal: Literal[".", ","] | None = None
    """decimal sign of the file [found out; refused where it has two meanings]"""
    columns: dict[str, str | tuple[str, str]] | None = None
    """header of torque, speed and share, hours or cycles in the file; of ranges of
    torque or speed two headers, from and to [their own names]"""
    units: dict[str, str] = options.option({})
    """units of torque, speed and share or hours; shares of time in % or [1], which sum
    to 100 or 1, or in h or s, in proportion to their sum [those in the headers]"""


class OperationStage(options.Part):
    """One of several conditions in order; wear carries over from each to the next."""

    label: str | None = options.option(None, identity=False)
    """name of the stage [its number]"""
    torque: Annotated[options.Torque, options.NOT_NEGATIVE]
    """torque on the input member"""
    speed: Annotated[options.Speed, options.POSITIVE]
    """speed of the input member"""
    cycles: Annotated[options.Number, options.POSITIVE] | None = None
    """cycles of the stage [up to wear.until, in the last stage]"""

    @property
    def side(self) -> Side:
        """The flanks that it loads."""
        return "front"


def _blocks(value: Any, info: pydantic.ValidationInfo) -> Any:
    """Return the blocks of a file as if they were written in place."""
    if isinstance(value, str):
        raise ValueError(f'{value!r} is a text: write duty = {{ file = "{value}" }}')
    if not isinstance(value, dict):
        return value
    if unknown := set(value) - set(DutyFile.model_fields):
        raise ValueError(
            f"unknown {', '.join(sorted(unknown))}: give file, sheet, decimal, "
            "columns and units of a table, or a list of {torque, speed, share}"
        )
    if "file" not in value:
        raise ValueError("'file' is required: {file, columns, units}")
    return duty_blocks(value, (info.context or {}).get("base_directory"))


def _shares(blocks: Any) -> Any:
    """Return conditions by their shares of time.

    Refuse shares that miss 1, conditions whose times differ in kind, and cycles at a
    standstill.
    """
    keys = {block.time_key: number for number, block in enumerate(blocks, 1)}
    if len(keys) > 1:
        said = " and ".join(f"{number} has {key!r}" for key, number in keys.items())
        raise ValueError(f"condition {said}: give one of them in all conditions")
    for number, block in enumerate(blocks, 1):
        if block.cycles is not None and block.speed == 0.0:
            raise ValueError(
                f"condition {number}: {block.cycles:g} cycles at speed 0 take no time: "
                "give its 'speed', or 'hours' in all conditions"
            )

    total = sum(block.time for block in blocks)
    if "share" in keys and abs(total - 1.0) > NEAR_ONE:
        raise ValueError(
            f"the shares of time sum to {total:.6g}, not to 1: mend them, or give "
            "'hours' in place of 'share', which need no sum"
        )
    if "share" in keys and abs(total - 1.0) <= SUM_OF_SHARES:
        return blocks
    return tuple(
        block.model_copy(
            update={"share": block.time / total, "hours": None, "cycles": None}
        )
        for block in blocks
    )


def _some_loaded(blocks: Any) -> Any:
    """Refuse a duty in which nothing is loaded that turns."""
    if not any(block.is_loaded for block in blocks):
        raise ValueError(
            "no condition has a torque and a speed that are not 0: give one that "
            "loads turning gears"
        )
    return blocks


def _labels(stages: Any) -> Any:
    """Refuse no stages, stages without an end before the last, and two of one name."""
    if not stages:
        raise ValueError("there is no stage: give torque, speed and cycles of each")
    open_ended = [
        number for number, stage in enumerate(stages[:-1], 1) if stage.cycles is None
    ]
    if open_ended:
        raise ValueError(
            f"stage {open_ended[0]} needs 'cycles': only the last one may go on to "
            "wear.until"
        )
    names = labels_of(stages)
    if len(set(names)) != len(names):
        raise ValueError(
            f"two stages have one label: {', '.join(names)}; give each its own"
        )
    return stages


def labels_of(stages: Any) -> list[str]:
    """Return the names of stages, their numbers where they have none."""
    return [stage.label or str(number) for number, stage in enumerate(stages, 1)]


Duty = Annotated[
    Annotated[tuple[DutyBlock, ...], pydantic.Tag("blocks")]
    | Annotated[DutyFile, pydantic.Tag("file")],
    pydantic.Discriminator(
        lambda given: "file" if isinstance(given, dict) else "blocks"
    ),
    pydantic.BeforeValidator(_blocks),
    pydantic.AfterValidator(_shares),
    pydantic.AfterValidator(_some_loaded),
]
OperationStages = Annotated[
    tuple[OperationStage, ...], pydantic.AfterValidator(_labels)
]


Central = Literal["pinion", "gear", "ring", "sun", "carrier"]


class TorqueFluctuation(options.Part):
    """A harmonic of the input torque, ``amplitude cos(order ω_m t + phase)``."""

    alternatives = ((("order",), ("frequency",)),)

    order: Annotated[options.Number, options.POSITIVE] | None = None
    """multiple of the mesh frequency [from frequency]. Source: L16 Eq. 9"""
    frequency: Annotated[options.Frequency, options.POSITIVE] | None = None
    """frequency of its own [from order]. Source: L16 Eq. 9"""
    amplitude: Annotated[options.Torque, options.NOT_NEGATIVE]
    """amplitude of the input torque. Source: L16 Eq. 5"""
    phase: options.Angle = 0.0
    """phase angle. Source: L16 Eq. 9"""

    def _check(self) -> None:
        if self.order is self.frequency is None:
            remedy = (
                "give its 'order', a multiple of the mesh frequency, or its 'frequency'"
            )
            raise ValueError(f'{remedy}, "25 Hz"')

    def order_at(self, period: float) -> float:
        """Return its multiple of the mesh frequency, at a mesh period [s]."""
        return (
            self.order if self.order is not None else (self.frequency or 0.0) * period
        )


Fluctuation = Annotated[
    Annotated[TorqueFluctuation, pydantic.Tag("one")]
    | Annotated[tuple[TorqueFluctuation, ...], pydantic.Tag("list")],
    pydantic.Discriminator(
        lambda given: "list" if isinstance(given, list | tuple) else "one"
    ),
]


class Operation(options.Part):
    """Torque and speed of the input member, or its power and one of them."""

    alternatives = (
        (("torque",), ("power",)),
        (("torque", "speed", "power"), ("duty",), ("stage",)),
    )

    torque: Annotated[options.Torque, options.NOT_NEGATIVE] = None
    """torque on the input member; drive_flank gives its sense [power over speed; none
    with duty or stage, whose conditions have their own]"""
    speed: Annotated[options.Speed, options.POSITIVE] = None
    """speed of the input member; revolutions or radians, never Hz [power over torque;
    none with duty or stage, whose conditions have their own]"""
    power: Annotated[options.Power, options.POSITIVE] | None = options.option(
        None, identity=False
    )
    """power at the input member, with torque or speed [torque times speed]. Source:
    B23"""
    input: Central = options.option(None)
    """driving member [pinion, sun]"""
    output: Central = options.option(None)
    """driven member [the other one, carrier]"""
    fixed: Central | None = None
    """member at rest in a planetary set [the one that is neither input nor output]"""
    load_torque: Literal["balance", "zero"] | None = None
    """torque on the output: what balances the input, or none with a grounded output
    [zero where a torsional support grounds the output, else balance]. Source: W23"""
    torque_fluctuation: Fluctuation | None = None
    """fluctuation of the input torque, one harmonic or a list of them [constant
    torque]. Source: L16 Eq. 9"""
    drive_flank: Literal["right", "left"] = "right"
    """flank that carries the load"""

    duty: Duty | None = None
    """conditions that take turns: wear rates mixed per cycle, by shares of time times
    speed; rows of no torque or no speed pass time, negative torque wears back flanks
    [torque and speed alone]. Source: wearlab"""
    stage: OperationStages | None = None
    """conditions in order, one after another; wear carries over [torque and speed
    alone]. Source: wearlab"""

    def __getattribute__(self, name: str) -> Any:
        """Return an attribute; one torque, speed or power is none of several.

        Raises
        ------
        SeveralConditions
            Who asks would take the value of one condition for that of all.
        """
        value = super().__getattribute__(name)
        if value is None and name in OF_ONE_CONDITION and self.several:
            raise SeveralConditions(
                f"operation.{name}: there are {len(self.several)} conditions, each "
                "with its own: ask for it in one of them"
            )
        return value

    @property
    def output_loaded(self) -> bool | None:
        """Whether a torque on the output balances the input; None: nobody said."""
        return None if self.load_torque is None else self.load_torque == "balance"

    _largest_torque: float | None = pydantic.PrivateAttr(None)
    _loaded_side: Side | None = pydantic.PrivateAttr(None)

    @property
    def fluctuation(self) -> tuple[TorqueFluctuation, ...]:
        """The harmonics of the torque whose amplitude is not nought."""
        harmonics = self.torque_fluctuation or ()
        return tuple(
            harmonic
            for harmonic in (
                harmonics if isinstance(harmonics, tuple) else (harmonics,)
            )
            if harmonic.amplitude != 0.0
        )

    @property
    def largest_torque(self) -> float:
        """The largest torque of all conditions that share these flanks [N m]."""
        of_conditions = [abs(condition.torque) for condition in self.several or (self,)]
        return float(max([*of_conditions, self._largest_torque or 0.0]))

    @property
    def loaded_side(self) -> Side | None:
        """The side of the teeth that is loaded, None where the other one never is."""
        return self._loaded_side

    def side_of(self, flank: str) -> str:
        """Return the side of the teeth that a flank is: ``right`` or ``left``.

        Parameters
        ----------
        flank : its name
        """
        is_right = (self.drive_flank == "right") != flank.endswith(BACK)
        return "right" if is_right else "left"

    @property
    def reverses(self) -> bool:
        """Whether some of its conditions load the back flanks."""
        sides = {block.side for block in self.loaded_blocks}
        return "back" in sides or self._loaded_side is not None

    def single_condition(
        self,
        torque: float,
        speed: float,
        largest_torque: float | None = None,
        side: Side | None = None,
    ) -> "Operation":
        """Return one condition alone.

        Of several that share flanks it knows the largest torque, and the side that it
        loads where some load the other; its torque has no sign.
        """
        changed = {
            "torque": torque,
            "speed": speed,
            "power": None,
            "duty": None,
            "stage": None,
        }
        condition = self.model_copy(update=changed)
        condition._largest_torque = largest_torque
        condition._loaded_side = side
        return condition

    @property
    def blocks(self) -> tuple[DutyBlock, ...]:
        """The conditions that take turns, none without a duty."""
        return self.duty if isinstance(self.duty, tuple) else ()

    @property
    def loaded_blocks(self) -> tuple[DutyBlock, ...]:
        """The conditions that take turns and wear flanks."""
        return tuple(block for block in self.blocks if block.is_loaded)

    @property
    def stages(self) -> tuple[OperationStage, ...]:
        """The conditions in order, none without stages."""
        return self.stage or ()

    @property
    def several(self) -> tuple[DutyBlock, ...] | tuple[OperationStage, ...]:
        """The conditions where there are several, in turn or in order."""
        return self.blocks or self.stages

    def in_conditions(self) -> tuple["Operation", ...]:
        """Return the operation in each of its conditions, itself where it is one.

        Idle ones and standstill are none: they wear nothing.

        Examples
        --------
        >>> blocks = [
        ...     {"torque": "80 N*m", "speed": "900 rpm", "share": 0.3},
        ...     {"torque": "20 N*m", "speed": "1500 rpm", "share": 0.7},
        ... ]
        >>> operation = Operation.model_validate({"duty": blocks})
        >>> [condition.torque for condition in operation.in_conditions()]
        [80.0, 20.0]
        """
        conditions = self.loaded_blocks or self.stages
        return tuple(
            self.single_condition(
                abs(condition.torque),
                condition.speed,
                self.largest_torque,
                condition.side if self.reverses else None,
            )
            for condition in conditions
        ) or (self,)

    def heaviest_condition(self) -> "Operation":
        """Return the operation in its condition of the largest torque."""
        return max(self.in_conditions(), key=lambda condition: condition.torque)

    @classmethod
    def _complete(
        cls, table: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        """Fill in who drives, who is driven and who is at rest."""
        gear_set = set_in(info.context)
        filled = dict(table)
        keys = ("input", "output", "fixed")
        placed = [filled[key] for key in keys if filled.get(key) is not None]
        for key, default in zip(
            keys[: len(gear_set.central)], gear_set.roles, strict=False
        ):
            free = [name for name in (default, *gear_set.central) if name not in placed]
            if filled.get(key) is not None or not free:
                continue
            if key == "input" and len(free) > 1 and default in placed:
                role = next(of for of in keys if filled.get(of) == default)
                conflict = f"the {default} drives by default, but is {role}"
                raise ValueError(
                    f"{conflict}; give input = {' or '.join(map(repr, free))}"
                )
            filled[key] = free[0]
            placed.append(free[0])
        return filled

    @pydantic.field_validator("input", "output", "fixed", mode="before")
    @classmethod
    def _known_members(cls, member: Any, info: pydantic.ValidationInfo) -> Any:
        """Refuse members that this gear set has not, or that cannot be central."""
        gear_set = set_in(info.context)
        if (
            member is not None
            and info.field_name == "fixed"
            and len(gear_set.central) < 3
        ):
            raise ValueError(
                "belongs to planetary sets; both gears of a pair turn: leave it out"
            )
        if member is None or member in gear_set.central:
            return member
        raise ValueError(
            f"{member!r} is no member that may be that; there are "
            f"{', '.join(gear_set.central)}"
        )

    def _one_alternative(self) -> None:
        """Allow two of torque, speed and power."""
        if self.several:
            return
        if None not in (self.torque, self.speed, self.power):
            rpm = self.speed * 30.0 / math.pi
            quantities = (
                f"torque = {self.torque:.6g} N*m, speed = {rpm:.6g} rpm and power = "
                f"{self.power:.6g} W"
            )
            remedy = (
                'leave one out; drop = ["operation.speed"] drops one that is inherited'
            )
            raise ValueError(f"{quantities} are one too many: {remedy}")

    def _check(self) -> None:
        """Give each member one role, and resolve power."""
        roles = {"input": self.input, "output": self.output, "fixed": self.fixed}
        named = [f"{key} {name!r}" for key, name in roles.items() if name is not None]
        if len(set(roles.values()) - {None}) != len(named):
            raise ValueError(
                f"one member in two roles: {', '.join(named)}; give each a member of "
                "its own"
            )
        if self.several:
            self._leave_to_conditions()
            return
        torque = self.torque
        speed = self.speed
        power = self.power
        if power is not None and torque is None and speed is not None:
            object.__setattr__(self, "torque", power / speed)
        elif power is not None and speed is None and torque:
            object.__setattr__(self, "speed", power / torque)
        if power is not None and torque == 0.0:
            raise ValueError(
                "a torque of 0 has no power: give speed in place of power, or a torque"
            )
        missing = [key for key in ("torque", "speed") if getattr(self, key) is None]
        if missing:
            raise ValueError(
                f"{' and '.join(missing)} missing: give torque and speed, such as "
                "'340 N*m' and '1100 rpm', "
                "or power with one of them"
            )

    def _leave_to_conditions(self) -> None:
        """Refuse a torque, speed or power beside those of several conditions.

        What stored scenes of earlier versions say of the first one is dropped.
        """
        if self.duty is not None and self.stage is not None:
            raise ValueError("give one of 'duty' and 'stage', not both")
        word = "duty" if self.duty is not None else "stage"
        first = self.several[0]
        for key in OF_ONE_CONDITION:
            general = self.__dict__[key]
            of_first = getattr(first, key, None)
            if general is not None and (
                of_first is None or units.rounded(general) != units.rounded(of_first)
            ):
                raise ValueError(
                    f"{key} stands in every {word}: leave operation.{key} out"
                )
            object.__setattr__(self, key, None)


def _of_the_set(value: Any, info: pydantic.ValidationInfo) -> Any:
    """Refuse a model of another kind of gear set, before its options are checked."""
    kind = set_in(info.context).kind
    model = value.get("model") if isinstance(value, dict) else value
    variants: dict[str, Any] = {**DynamicModel.slot.variants}
    chosen = variants.get(model) if isinstance(model, str) else None
    if chosen is not None and kind and kind not in chosen.kinds:
        fitting = [name for name, variant in variants.items() if kind in variant.kinds]
        raise PydanticCustomError(
            "not_of_the_set",
            "{model} does not belong to gears of kind {kind}; give {own}",
            {
                "model": repr(model),
                "kind": repr(kind),
                "own": " or ".join(map(repr, fitting)),
            },
        )
    return value


Dynamics = Annotated[DynamicModel, pydantic.BeforeValidator(_of_the_set)]
