"""Quantities that ``exclude`` may ask for and that need gears: computed when a condition names them."""

from wearlab.query import Key
from wearlab.scene import Scene

KEYS = (
    Key("contact_ratio"),
    Key("mesh_frequency", unit="Hz", display_unit="Hz"),
    Key("speed_ratio"),
)
DERIVED = tuple(key.name for key in KEYS)


class Derivation:
    """Computes derived quantities; what several cases share is computed once."""

    def __init__(self) -> None:
        self._critical: dict[str, float | None] = {}

    def __call__(self, name: str, scene: Scene) -> float | None:
        """Return a quantity of `DERIVED`; None where no such gears can be, or the scene has no such thing.

        ``mesh_frequency`` is in Hz; ``speed_ratio`` is the speed of the input over its first critical speed,
        where the mesh frequency meets the lowest natural frequency that the mesh excites.
        """
        from wearlab.gears.specification import GearError

        try:
            return {"contact_ratio": _contact_ratio, "mesh_frequency": _mesh_frequency}.get(
                name, self._speed_ratio
            )(scene)
        except GearError:
            return None

    def _speed_ratio(self, scene: Scene) -> float | None:
        if scene.dynamics is None or scene.operation.speed is None:
            return None
        same = scene.replace("operation.speed", "1 rpm").canonical()
        if same not in self._critical:
            self._critical[same] = _first_excited(scene)
        first, frequency = self._critical[same], _mesh_frequency(scene)
        return None if first is None or frequency is None else frequency / first


def _contact_ratio(scene: Scene) -> float:
    """Return the contact ratio, the smallest where a set has meshes of several kinds."""
    from wearlab.scene.build.sets import build_set

    return min(float(kind.pair.contact_ratio) for kind in build_set(scene).kinds)


def _mesh_frequency(scene: Scene) -> float | None:
    from wearlab.scene.build.sets import build_set

    return None if scene.operation.speed is None else float(build_set(scene).mesh_frequency)


def _first_excited(scene: Scene) -> float | None:
    """Return the lowest natural frequency that the mesh excites [Hz]."""
    from wearlab.scene.build import build
    from wearlab.scene.build.modes import build_modes

    modes = build_modes(build(scene)).modes
    excited = modes.frequency[modes.excited()]
    return float(excited.min()) if excited.size else None
