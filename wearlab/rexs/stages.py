"""The stages of a gear unit, and each as a campaign file has it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.rexs import operation, pairs, planetary, stated
from wearlab.rexs.container import read_document
from wearlab.rexs.document import Component, Document, RexsError
from wearlab.rexs.draft import Draft
from wearlab.rexs.quantities import number

TAKEN = ("cylindrical_stage", "planetary_stage")


class Stage(NamedTuple):
    """One stage of a file, as a list shows it.

    Parameters
    ----------
    number : from 1, in the order of the file
    name : what its writer calls it
    type : of its component
    kind : of the gear set; "" where wearlab has none
    teeth : of its gears
    module : normal module [mm], None where it is not given
    centre_distance : [mm], None where it is not given
    reason : why it cannot be taken; "" where it can
    """

    number: int
    name: str
    type: str
    kind: str
    teeth: tuple[int, ...]
    module: float | None
    centre_distance: float | None
    reason: str


class GearUnit(NamedTuple):
    """A file and its stages.

    Parameters
    ----------
    document : the file
    stages : in its order
    components : of the stages, in the same order
    """

    document: Document
    stages: tuple[Stage, ...]
    components: tuple[Component, ...]

    def draft(self, stage: int, case: int | None = None) -> Draft:
        """Return one stage as a campaign file has it.

        Parameters
        ----------
        stage : its number, from 1
        case : number of the one load case to take, from 1; None takes all as a duty

        Raises
        ------
        RexsError : no such stage or case, or one that cannot be taken
        """
        shown = _entry(self.stages, stage, "stage")
        if shown.reason:
            raise RexsError(f"stage {stage}: {shown.reason}")
        cases = self.document.load_cases
        if case is not None:
            cases = (_entry(cases, case, "load case"),)

        component = self.components[stage - 1]
        first = self.document.in_case(cases[0] if cases else None)
        title = (
            f"{shown.name or shown.type} of {self.document.program or 'a REXS file'}"
        )
        draft = Draft(title)
        kind = planetary if shown.type == "planetary_stage" else pairs
        roles = kind.put_stage(draft, first, component)
        operation.put_operation(draft, self.document, component, roles, cases)
        operation.put_lubricant(draft, first, component)
        stated.keep_stated(draft, first, component, roles)
        _put_the_rest(draft, first, component)
        return draft


def _entry(entries: tuple[Any, ...], number_: int, what: str) -> Any:
    """Return an entry by its number from 1."""
    if not 1 <= number_ <= len(entries):
        raise RexsError(
            f"there is no {what} {number_}: the file has {len(entries)}"
            + (f", 1 to {len(entries)}" if entries else "")
        )
    return entries[number_ - 1]


def read_unit(path: str | Path) -> GearUnit:
    """Return the stages of a REXS file.

    Parameters
    ----------
    path : ``.rexs``, ``.rexsj``, or a zip with one of them

    Raises
    ------
    RexsError : it cannot be read, or has no stage
    """
    document = read_document(path)
    components = tuple(_stage_components(document))
    if not components:
        raise RexsError(f"{path}: there is no stage in it: export the gear unit whole")

    stages = tuple(
        _stage(document, component, place)
        for place, component in enumerate(components, 1)
    )
    return GearUnit(document, stages, components)


def read_rexs(path: str | Path) -> list[dict[str, Any]]:
    """Return the stages of a REXS file as campaign files.

    Parameters
    ----------
    path : ``.rexs``, ``.rexsj``, or a zip with one of them

    Returns
    -------
    a dict for every stage that wearlab has a kind of gear set for, as `wearlab.run`
    takes it once wear is added

    Raises
    ------
    RexsError : the file cannot be read, or has no stage

    Examples
    --------
    ::

        import wearlab as wl

        study = wl.read_rexs("gearbox.rexs")[0]
        study["wear"] = {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"cycles": 1e7},
        }
        wl.run(study, wl.Store("wearlab-store"))
    """
    unit = read_unit(path)
    return [
        unit.draft(stage.number).table() for stage in unit.stages if not stage.reason
    ]


def _stage_components(document: Document) -> Iterator[Component]:
    """Yield the stages; the pairs within a planetary stage are part of it."""
    inside = {
        part.id
        for stage in document.of_type("planetary_stage")
        for part in document.partners("assembly", "assembly", stage.id, "part")
    }
    for component in document.components.values():
        if component.type.endswith("_stage") and component.id not in inside:
            yield component


def _stage(document: Document, component: Component, place: int) -> Stage:
    """Return a stage as a list shows it."""
    if component.type not in TAKEN:
        article = "an" if component.type[:1] in "aeiou" else "a"
        reason = (
            f'"{component.name or component.id}" is {article} {component.type}: '
            "wearlab has cylindrical gears and planetary sets only"
        )
        return Stage(place, component.name, component.type, "", (), None, None, reason)

    try:
        if component.type == "planetary_stage":
            shown = planetary.summary(document, component)
        else:
            shown = pairs.summary(document, component)
    except RexsError as error:
        return Stage(
            place, component.name, component.type, "", (), None, None, str(error)
        )
    return Stage(place, component.name, component.type, *shown, reason="")


def _put_the_rest(draft: Draft, document: Document, component: Component) -> None:
    """Say what a life needs beside the file, and compare contact ratios."""
    draft.entries.setdefault("mesh", {})
    draft.missing += [
        "[wear]: add it, else one state without wear is computed:",
        '  coefficient = { model = "constant", value = "1e-18 m^2/N" } # of your test',
        "  until = { hours = 10000 }",
    ]
    ratio = number(component, "radial_contact_ratio") or number(
        component, "transverse_contact_ratio"
    )
    if ratio is not None:
        draft.derived.append(f"the file's {ratio.source} is {ratio.value:.6g}")
