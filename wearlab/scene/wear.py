"""``[wear]``: law, coefficient, initial wear and end of a life.

``[start]``: the run that it goes on from.
"""

import re
from typing import Annotated, Any, NamedTuple

import pydantic
from annotated_types import Le, MinLen

from wearlab import options, units
from wearlab.life import loads, steps
from wearlab.life.steps.adaptive import AdaptiveStep
from wearlab.scene import gears, identity
from wearlab.wear import coefficients, initials, laws, patches, pressures, projections
from wearlab.wear.laws.archard import ArchardLaw
from wearlab.wear.patches.elastic import ElasticPatch
from wearlab.wear.pressures.mean import MeanPressure
from wearlab.wear.projections.normal import NormalProjection

NAMES = (*dict.fromkeys((*gears.ALL_TOOTHED, *gears.ALL_FLANKS)), "carrier")
OneCoefficient = coefficients.CoefficientModel


def _per_member(value: Any, info: pydantic.ValidationInfo) -> Any:
    """Read per-member tables as overrides of the general one."""
    if not isinstance(value, dict):
        return value
    members = gears.set_in(info.context).toothed
    if strangers := [
        repr(name) for name in NAMES if name in value and name not in members
    ]:
        problem = (
            f"no member with teeth of this gear set; there are {', '.join(members)}"
        )
        raise ValueError(f"{', '.join(strangers)}: {problem}")
    if value.keys().isdisjoint(members):
        return value
    general = {key: option for key, option in value.items() if key not in members}
    return {member: _over(general, value.get(member, {})) for member in members}


def _over(general: dict[str, Any], table: Any) -> Any:
    """Return a member's options over the general ones; another model starts afresh."""
    table = {"model": table} if isinstance(table, str) else table
    if not isinstance(table, dict) or table.get(
        "model", general.get("model")
    ) != general.get("model"):
        return table
    return {**general, **table}


def _one_if_equal(coefficients: Any) -> Any:
    """Return one coefficient where both members have the same."""
    if not isinstance(coefficients, dict):
        return coefficients
    different = {
        identity.canonical(coefficient.model_dump())
        for coefficient in coefficients.values()
    }
    return next(iter(coefficients.values())) if len(different) == 1 else coefficients


def _one_or_each(value: Any) -> str:
    return (
        "each"
        if isinstance(value, dict) and not value.keys().isdisjoint(gears.ALL_TOOTHED)
        else "one"
    )


Coefficient = Annotated[
    Annotated[OneCoefficient, pydantic.Tag("one")]
    | Annotated[dict[str, OneCoefficient], pydantic.Tag("each")],
    pydantic.Discriminator(_one_or_each),
    pydantic.BeforeValidator(_per_member),
    pydantic.AfterValidator(_one_if_equal),
]


Positive = Annotated[options.Number, options.POSITIVE]
PositiveDepth = Annotated[options.Depth, options.POSITIVE]


def _ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    """Sort values; those that identity does not tell apart are one."""
    return tuple(
        {units.rounded(value): value for value in sorted(values, reverse=True)}.values()
    )[::-1]


OF_FLANK: Any = {
    flank: (
        initials.InitialModel | None,
        options.option(None, f"initial wear of {flank}"),
    )
    for flank in gears.ALL_FLANKS
}
InitialWears = pydantic.create_model(
    "InitialWears",
    __base__=options.Part,
    __doc__="Initial wear of each flank.",
    **OF_FLANK,
)  # some flanks have names that Python could not spell


def _of_the_set(flank: Any, info: pydantic.ValidationInfo) -> Any:
    """Return the name of a flank, or refuse one that this kind of gear set has not."""
    flanks = gears.set_in(info.context).flanks
    if flank is None or flank in flanks:
        return flank
    raise ValueError(
        f"{flank!r} is no flank of this gear set; there are {', '.join(flanks)}"
    )


Flank = Annotated[str, pydantic.BeforeValidator(_of_the_set)]


class Until(options.Part):
    """Where the life ends: at the first limit reached."""

    cycles: Positive | None = None
    """revolutions of the pinion [no such limit]"""
    mesh_cycles: Positive | None = None
    """mesh cycles [no such limit]"""
    hours: Annotated[options.Hours, options.POSITIVE] | None = None
    """operating hours, a plain count or a time with its unit [no such limit]"""
    depth: PositiveDepth | None = None
    """largest wear depth [no such limit]. Source: W23: 400 µm"""
    flank: Flank | None = None
    """the flank whose largest depth counts [whichever is deepest]"""

    def _check(self) -> None:
        if self.cycles is self.mesh_cycles is self.hours is self.depth is None:
            raise ValueError(
                "give at least one of 'cycles', 'mesh_cycles', 'hours', 'depth'"
            )
        if self.flank is not None and self.depth is None:
            raise ValueError("'flank' belongs to a 'depth', and there is none")


class SnapshotOptions(options.Part):
    """Wear states stored on the way; asking for them changes nothing."""

    alternatives = ((("cycles",), ("mesh_cycles",), ("depth", "flank")),)

    cycles: (
        Annotated[tuple[Positive, ...], MinLen(1), pydantic.AfterValidator(_ascending)]
        | None
    ) = None
    """at these revolutions of the pinion [not by cycles]"""
    mesh_cycles: (
        Annotated[tuple[Positive, ...], MinLen(1), pydantic.AfterValidator(_ascending)]
        | None
    ) = None
    """at these mesh cycles [not by mesh cycles]"""
    depth: (
        Annotated[
            tuple[PositiveDepth, ...], MinLen(1), pydantic.AfterValidator(_ascending)
        ]
        | None
    ) = None
    """when the wear reaches these depths [not by depth]"""
    flank: Flank | None = None
    """the flank whose largest depth counts [whichever is deepest]"""

    def _check(self) -> None:
        if self.cycles is self.mesh_cycles is self.depth is None:
            raise ValueError("give one of 'cycles', 'mesh_cycles', 'depth'")


class WearSection(options.Part):
    """Archard's law along the path, stepped over cycles."""

    alternatives = ((("contact_patch",), ("average_over_contact_width",)),)

    coefficient: Coefficient | None = None
    """wear coefficient k; required with until [nothing wears]. Source: Archard 1953"""
    law: laws.LawModel = ArchardLaw()
    """how much is worn away in a cycle. Source: Archard 1953"""
    load: loads.LoadModel = options.option(None)
    """force that wears: when the point is in contact, L16's Miner torque, or static
    [instant with dynamics, static without]. Source: L16 Eq. 25"""
    wohler_slope: Positive | None = None
    """Wöhler slope of the equivalent load; not printed in L16 [no equivalent_load].
    Source: L16 Eq. 25"""
    pressure: pressures.PressureModel = MeanPressure()
    """Hertz pressure in the law; peak is 4/π times. Source: Archard 1953"""
    projection: projections.ProjectionModel = NormalProjection()
    """direction of the depth: along the normal, or W23's h/cos α. Source: W23 Eq. 33"""
    contact_patch: patches.PatchModel = ElasticPatch()
    """over the width of contact wear is: taken point by point; spread; spread and felt;
    spread, felt and levelled by the pressure that redistributes inside. Source: Johnson
    1985"""
    average_over_contact_width: options.Switch | None = None
    """another word: true for contact_patch = one-way, false for none [as contact_patch
    says]. Source: Archard 1953"""
    initial: Annotated[
        InitialWears | None,
        pydantic.BeforeValidator(lambda given: None if given == {} else given),
    ] = None
    """wear before the first cycle [new flanks]"""
    until: Until | None = None
    """where the life ends [one wear state]"""
    snapshots: SnapshotOptions | None = None
    """states stored on the way [accepted steps]"""
    step: steps.StepMethod = AdaptiveStep()
    """how the wear is stepped over cycles. Source: wearlab"""

    @classmethod
    def _complete(
        cls, table: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        """Read the other word for a contact patch as what it means."""
        averaged = table.get("average_over_contact_width")
        if "contact_patch" in table or not isinstance(averaged, bool):
            return table
        rest = {
            key: value
            for key, value in table.items()
            if key != "average_over_contact_width"
        }
        return {**rest, "contact_patch": "one-way" if averaged else "none"}

    def coefficient_of(self, flank: str) -> Any:
        """Return the coefficient of one flank, that of its member, None when nothing wears."""
        coefficient = self.coefficient
        return (
            coefficient[gears.member_of(flank)]
            if isinstance(coefficient, dict)
            else coefficient
        )

    def initial_of(self, flank: str) -> Any:
        """Return the initial wear of one flank, None when it is new."""
        return None if self.initial is None else getattr(self.initial, flank)


ID = re.compile(r"[0-9a-f]{20,64}")


class StartWear(NamedTuple):
    """The wear that a run starts from, read from its parent.

    Parameters
    ----------
    cycle : of the parent, at which it was taken
    error : of its interpolation between stored states, estimated [m]; 0 at a stored
        state
    side : flank → side of the tooth that the parent loaded
    position : flank → (n,) path coordinate of the nodes [m]
    depth : flank → (n,) wear depth there [m]
    estimate : error of the parent's wear depth at that cycle, as the parent estimates
        it [m]; NaN: unknown
    """

    cycle: float
    error: float
    side: dict[str, str]
    position: dict[str, tuple[float, ...]]
    depth: dict[str, tuple[float, ...]]
    estimate: float = 0.0


def _identity(text: str) -> str:
    if not ID.fullmatch(text):
        raise ValueError(
            f"{text!r} is no full id of a run, 20 hexadecimal digits as `wearlab ls "
            "--json` shows it; or "
            "give 'campaign' and 'select'"
        )
    return text


class Start(options.Part):
    """Another run's wear at one of its cycles.

    ``cycle`` counts from 0 again, ``parent_cycle`` is kept.

    A campaign file may name the run by ``campaign`` and ``select`` instead of ``run``.
    """

    alternatives = (
        (("run",), ("campaign", "select")),
        (("cycle",), ("life_fraction",)),
    )

    run: Annotated[str, pydantic.AfterValidator(_identity)] | None = None
    """identity of the run to continue [named by campaign and select]. Source:
    wearlab"""
    campaign: str | None = options.option(None, identity=False)
    """campaign file whose run is continued [named by run]. Source: wearlab"""
    select: dict[str, Any] | None = options.option(None, identity=False)
    """axis = value or case = label, of the run in that campaign [its only run]. Source:
    wearlab"""
    cycle: Annotated[options.Number, options.NOT_NEGATIVE] | None = None
    """cycle of that run at which this one begins [its last state]. Source: wearlab"""
    life_fraction: Annotated[options.Number, options.NOT_NEGATIVE, Le(1.0)] | None = (
        None
    )
    """the same as a fraction of that run's life [its last state]. Source: wearlab"""
    replace: tuple[str, ...] = ()
    """members that get new flanks. Source: wearlab"""

    def _check(self) -> None:
        if self.run is None:
            raise ValueError(
                "give 'run', or 'campaign' and 'select', of the run to continue"
            )


def is_replaced(flank: str, replaced: tuple[str, ...]) -> bool:
    """Say whether a flank belongs to one of the replaced members."""
    return gears.member_of(flank) in replaced
