"""Values along the path of contact: forces on teeth, pressure, sliding, film."""

from collections.abc import Callable, Sequence

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.simulation import label
from wearlab.simulation.dataset.coordinates import States, by_flank
from wearlab.simulation.dataset.face import face_states
from wearlab.simulation.dataset.thermal import pressure_velocity, warm_kinds
from wearlab.wear import films, law, path


def path_values(model: assembly.GearModel, states: States) -> label.Values:
    """Return forces, pressures, sliding and film where the flanks touch.

    Parameters
    ----------
    model : the physics of the scene
    states : the wear states that are stored
    """
    kinds = model.kinds
    axes = 1 if model.face is None else 2
    pressure_factor = model.pressure_factor
    warm = None if model.scene.thermal is None else warm_kinds(model, states)
    forces = [_mean_forces(model, states, kind) for kind in range(len(kinds))]

    def on_both_flanks(
        of_force: Callable[[assembly.MeshKindModel, Array], Array],
        under: Sequence[Array] = forces,
    ) -> Array:
        """Return what both flanks share, (n_updates, n_flanks, …, n)."""
        of_kind = []
        for number, kind_forces in enumerate(under):
            values = _of_states(of_force, kinds[number], number, kind_forces, warm)
            of_kind.append(np.stack([values, values], axis=1))
        return by_flank(model, of_kind, axes)

    values = label.Values()
    if model.face is None:
        values["tooth_force"] = on_both_flanks(lambda kind, load: load)
    values["contact_pressure"] = on_both_flanks(
        lambda kind, load: pressure_factor * path.mean_pressure(load, kind.path)
    )

    wearing = [_wearing_forces(model, states, kind) for kind in range(len(kinds))]
    values["contact_half_width"] = on_both_flanks(
        lambda kind, load: path.contact_half_width(load, kind.path), wearing
    )

    every_update = np.ones((len(states), 1, 1))
    sliding = by_flank(model, [path.sliding_velocity(kind.path) for kind in kinds])
    specific_sliding = by_flank(model, [kind.path.specific_sliding for kind in kinds])
    values["sliding_velocity"] = every_update * sliding
    values["specific_sliding"] = every_update * specific_sliding

    if all(kind.film is not None for kind in kinds):
        values["film_thickness"] = on_both_flanks(film_thickness)
        values["lambda_ratio"] = on_both_flanks(lambda_ratio)
    if model.face is None and all(kind.law is not None for kind in kinds):
        coefficients = [
            _effective_coefficient(
                [of_state[number] for of_state in warm or [kinds] * len(states)],
                kind_forces,
                depths(number, states),
            )
            for number, kind_forces in enumerate(forces)
        ]
        values["effective_wear_coefficient"] = by_flank(model, coefficients)
    if warm is not None:
        values["pressure_velocity"] = pressure_velocity(
            values["contact_pressure"], values["sliding_velocity"]
        )
    return values


def _of_states(
    of_force: Callable[[assembly.MeshKindModel, Array], Array],
    kind: assembly.MeshKindModel,
    number: int,
    forces: Array,
    warm: list[tuple[assembly.MeshKindModel, ...]] | None,
) -> Array:
    """Return a function of the forces of all states, each as warm as it is.

    Parameters
    ----------
    of_force : of a kind of mesh and forces on a pair
    kind, number : the kind of mesh, and its number
    forces : (n_updates, …, n) on a pair [N]
    warm : the kinds of mesh of each state, None where temperature does not count
    """
    if warm is None:
        return of_force(kind, forces)
    rows = [
        of_force(kinds[number], force)
        for kinds, force in zip(warm, forces, strict=True)
    ]
    return np.stack(rows)


def _mean_forces(model: assembly.GearModel, states: States, kind: int) -> Array:
    """Return the mean forces on a pair along the path, (n_updates, …, n) [N].

    Over the face: as if all of it carried as much as the slice does.
    """
    if model.face is None:
        return np.stack([state.kind[kind].mean_tooth_force for state in states])
    line_loads = [state.line_load for state in face_states(states, kind)]
    return np.stack(line_loads) * model.kinds[kind].path.face_width


def half_widths_of(model: assembly.GearModel, states: States, kind: int) -> Array:
    """Return half widths of contact at the nodes, (n_updates, …, n) [m].

    Of gears that are not warm.

    Parameters
    ----------
    model : the physics of the scene
    states : the wear states
    kind : number of the kind of mesh
    """
    force = _wearing_forces(model, states, kind)
    return path.contact_half_width(force, model.kinds[kind].path)


def _wearing_forces(model: assembly.GearModel, states: States, kind: int) -> Array:
    """Return the forces that make the patches along the path, (n_updates, …, n) [N].

    Of forces that take turns the mean with the weight of what they wear.
    """
    return np.stack(
        [
            of_kind.patch_force.reshape(np.shape(of_kind.wear)[1:])
            for of_kind in (state.kind[kind] for state in states)
        ]
    )


def film_thickness(kind: assembly.MeshKindModel, load: Array) -> Array:
    """Return the film thickness along the path, (…, n) [m].

    Parameters
    ----------
    kind : the physics of a kind of mesh that has a film
    load : (…, n) forces on a pair [N]
    """
    assert kind.film is not None
    ratio = _lambda_ratio_of_law(kind, load)
    if ratio is not None:
        return ratio * kind.film.roughness
    return films.film_thickness(kind.film, kind.path, load)


def lambda_ratio(kind: assembly.MeshKindModel, load: Array) -> Array:
    """Return λ, the film thickness over the roughness, along the path, (…, n) [1].

    Parameters
    ----------
    kind : the physics of a kind of mesh that has a film
    load : (…, n) forces on a pair [N]
    """
    assert kind.film is not None
    ratio = _lambda_ratio_of_law(kind, load)
    if ratio is not None:
        return ratio
    return films.film_thickness(kind.film, kind.path, load) / kind.film.roughness


def _lambda_ratio_of_law(kind: assembly.MeshKindModel, load: Array) -> Array | None:
    """Return λ as the wear law knows it, None where it knows none."""
    return None if kind.law is None else law.lambda_ratio(kind.law, load)


def _effective_coefficient(
    kinds: Sequence[assembly.MeshKindModel], forces: Array, depth: Array
) -> Array:
    """Return the effective wear coefficient at the nodes, (n_updates, 2, n) [m²/N].

    The kinds are one kind of mesh in each of the states.
    """
    rows = [
        law.effective_coefficient(kind.law, load, worn)
        for kind, load, worn in zip(kinds, forces, depth, strict=True)
        if kind.law is not None
    ]
    return np.stack(rows)


def depths(kind: int, states: States) -> Array:
    """Return the depths of one kind of mesh, (n_updates, 2, …, n) [m].

    Parameters
    ----------
    kind : number of the kind of mesh
    states : the wear states
    """
    return np.stack([state.kind[kind].wear for state in states])
