"""Gear units of other programs: ``import`` lists the stages of a REXS file."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from wearlab.cli import app, options, output

if TYPE_CHECKING:
    from wearlab.rexs.draft import Draft
    from wearlab.rexs.stages import GearUnit, Stage

HEADS = ("stage", "name", "kind", "teeth", "m_n [mm]", "a [mm]", "load cases")


@app.command(
    "import",
    help="List the stages of FILE (REXS: .rexs, .rexsj, or a zip of one); with --stage "
    "write one as a campaign file.",
)
def import_file(
    file: Annotated[
        Path, options.argument("FILE", "A gear unit: .rexs, .rexsj or a zip of one.")
    ],
    stage: Annotated[
        int | None,
        options.option("--stage", "The stage to take, by its number in the list.", "N"),
    ] = None,
    case: Annotated[
        int | None,
        options.option(
            "--case", "The one load case to take.", "N", show_default="all, as a duty"
        ),
    ] = None,
    out: Annotated[
        Path | None,
        options.option(
            "--out", "The campaign file to write.", "FILE", show_default="the terminal"
        ),
    ] = None,
) -> output.Findings:
    """List the stages of a gear unit, or write one as a campaign file."""
    from wearlab.rexs.document import RexsError
    from wearlab.rexs.stages import read_unit

    with output.refusing(RexsError, OSError), output.reporting(f"reading {file}"):
        unit = read_unit(file)
        if stage is None:
            return _listed(unit, file, case, out)
        draft = unit.draft(stage, case)
        _add_contact_ratio(draft)
        return _written(draft, file, out)


def _listed(
    unit: "GearUnit", file: Path, case: int | None, out: Path | None
) -> output.Findings:
    """Return the list of stages; what asks for one stage needs its number."""
    taken = [stage for stage in unit.stages if not stage.reason]
    refusals = [f"{file}: {stage.reason}" for stage in unit.stages if stage.reason]
    if not taken:
        raise output.Stop("\n".join(refusals))
    if case is not None or out is not None:
        raise output.Stop(f"{file}: say which stage: --stage {taken[0].number}")

    cases = len(unit.document.load_cases)
    table = output.ShownTable(HEADS, [_row(stage, cases) for stage in taken])
    remedy = f"wearlab import {file} --stage {taken[0].number} --out study.toml"
    content = {
        "version": unit.document.version,
        "program": unit.document.program,
        "stages": [stage._asdict() for stage in unit.stages],
        "load_cases": [case.name for case in unit.document.load_cases],
    }
    return output.Findings(content, [table, f"next: {remedy}"], True, refusals)


def _row(stage: "Stage", cases: int) -> list[str]:
    """Return a stage as a row of the list."""
    return [
        str(stage.number),
        stage.name,
        stage.kind,
        "/".join(map(str, stage.teeth)),
        "" if stage.module is None else f"{stage.module:g}",
        "" if stage.centre_distance is None else f"{stage.centre_distance:g}",
        str(cases),
    ]


def _add_contact_ratio(draft: "Draft") -> None:
    """Say what contact ratio the gears have here, or why wearlab refuses them."""
    from wearlab.assembly import sets
    from wearlab.gears.specification import GearError
    from wearlab.scene import Scene, SceneError

    table = {key: draft.table().get(key, {}) for key in ("gears", "mesh")}
    load = {"torque": "1 N*m", "speed": "1 rpm"}
    try:
        scene = Scene.from_mapping({**table, "operation": load})
        gears = sets.build_set(scene)
    except (SceneError, GearError) as error:
        draft.missing.append(f"as it stands wearlab refuses these gears: {error}")
        return

    for mesh in gears.kinds:
        ratio = mesh.pair.contact_ratio
        flanks = " and ".join(mesh.flanks)
        draft.derived.append(f"transverse contact ratio of {flanks}: {ratio:.5f}")


def _written(draft: "Draft", file: Path, out: Path | None) -> output.Findings:
    """Write a stage where it was asked for, and say what is missing."""
    from wearlab.rexs.draft import printable
    from wearlab.store.files import write_whole

    text = f"# from {printable(file.name)}\n{draft.text()}"
    content: dict[str, Any] = {
        "campaign": draft.table(),
        "derived": draft.derived,
        "left_out": draft.left_out,
        "missing": draft.missing,
    }
    if out is None:
        return output.Findings(content, text.splitlines())
    if out.exists():
        raise output.Stop(f"{out}: is there already; name another with --out")

    write_whole(out, text.encode())
    content["file"] = str(out)
    remarks = [f"left out: {line}" for line in draft.left_out]
    remarks += [f"missing: {line.strip()}" for line in draft.missing]
    return output.Findings(
        content, [f"{out}: now look at it, then: wearlab check {out}"], True, remarks
    )
