"""Which parts a scene has, and which it leaves out: not computed, not compiled, not stored."""

from collections.abc import Iterable

from wearlab.scene.scene import Scene


def _parts(scene: Scene) -> dict[str, str | None]:
    """Return every part by its word; with what is chosen of it, None when it is left out."""
    wear, dynamics, errors = scene.wear, scene.dynamics, scene.errors
    meshes = scene.mesh.each(scene.gears.kind)
    gears = list(scene.gears.gears().values())
    oil = scene.lubricant is not None and all(g.roughness_ra is not None for g in gears)
    modified = any(g.tip_relief or g.root_relief or g.profile_crowning or g.profile_slope for g in gears)
    coefficients = (
        []
        if wear is None or wear.coefficient is None
        else [wear.coefficient_of(m) for m in scene.gears.toothed]
    )
    models = sorted({coefficient.chosen for coefficient in coefficients})
    return {
        "gears": scene.gears.kind,
        "flank modifications": "" if modified else None,
        "mesh stiffness": _chosen(mesh.stiffness.chosen for mesh in meshes),
        "contact": _chosen(mesh.contact.chosen for mesh in meshes),
        "contact beyond A and E": "" if any(mesh.extended_contact for mesh in meshes) else None,
        "errors": None if errors is None else errors.slow.chosen,
        "dynamics": None if dynamics is None else f"{dynamics.chosen}, {dynamics.method}",
        "excitation": None if dynamics is None else meshes[0].excitation.chosen,
        "back flank": None
        if dynamics is None or all(mesh.normal_backlash is None for mesh in meshes)
        else "",
        "friction": None if dynamics is None or dynamics.friction is None else "",
        "response over speed": None
        if dynamics is None or dynamics.response is None
        else dynamics.response.direction,
        "torque fluctuation": None if dynamics is None or scene.operation.torque_fluctuation is None else "",
        "duty": f"{len(scene.operation.blocks)} conditions" if scene.operation.duty else None,
        "stages": f"{len(scene.operation.stages)} in order" if scene.operation.stage else None,
        "film": "" if oil else None,
        "film in the coefficient": "" if any(coefficient.film for coefficient in coefficients) else None,
        "initial wear": None if wear is None or wear.initial is None else "",
        "start from another run": None if scene.start is None else str(scene.start.run)[:10],
        "wear": f"{' and '.join(models)} coefficient, {wear.load.chosen} load" if wear and models else None,
        "life": wear.step.chosen if wear and (wear.until or scene.operation.stage) else None,
    }


def _chosen(models: Iterable[str]) -> str:
    """Return what each kind of mesh has, once where they have the same."""
    return " and ".join(dict.fromkeys(models))


def parts_present(scene: Scene) -> list[str]:
    """Return the parts a scene has, each with what is chosen of it."""
    return [
        f"{word}: {chosen}" if chosen else word
        for word, chosen in _parts(scene).items()
        if chosen is not None
    ]


def parts_left_out(scene: Scene) -> list[str]:
    """Return the parts a scene leaves out."""
    return [word for word, chosen in _parts(scene).items() if chosen is None]
