"""Kinds of gear sets: their members, flanks and meshes, and which of them may drive."""

from typing import NamedTuple


class SetDescriptor(NamedTuple):
    """A kind of gear set.

    Parameters
    ----------
    kind : its name in campaign files
    members : the members, in the order of datasets
    toothed : those that have teeth
    flanks : the flanks that wear
    meshes : the kinds of mesh, of which there may be several each
    sections : where ``[mesh]`` may say something of one kind of mesh alone, "" where
        there is but one
    central : members that may be input, output or fixed
    roles : of these, which are input, output and fixed where the file does not say
    """

    kind: str
    members: tuple[str, ...]
    toothed: tuple[str, ...]
    flanks: tuple[str, ...]
    meshes: tuple[str, ...]
    sections: tuple[str, ...]
    central: tuple[str, ...]
    roles: tuple[str, ...]

    @property
    def is_pair(self) -> bool:
        """Whether it is one mesh of two gears."""
        return len(self.meshes) == 1


def _pair(kind: str, mate: str) -> SetDescriptor:
    """Return the descriptor of a pinion and its mate."""
    gears = ("pinion", mate)
    return SetDescriptor(
        kind=kind,
        members=gears,
        toothed=gears,
        flanks=gears,
        meshes=(f"pinion-{mate}",),
        sections=("",),
        central=gears,
        roles=gears,
    )


EXTERNAL_PAIR = _pair("external-pair", "gear")
INTERNAL_PAIR = _pair("internal-pair", "ring")
PLANETARY = SetDescriptor(
    kind="planetary",
    members=("sun", "planet", "ring", "carrier"),
    toothed=("sun", "planet", "ring"),
    flanks=("sun", "planet-sun", "planet-ring", "ring"),
    meshes=("sun-planet", "planet-ring"),
    sections=("sun_planet", "planet_ring"),
    central=("sun", "ring", "carrier"),
    roles=("sun", "carrier", "ring"),
)
SETS = {
    descriptor.kind: descriptor
    for descriptor in (EXTERNAL_PAIR, INTERNAL_PAIR, PLANETARY)
}
"""Every kind of gear set, by name."""


def _any(field: str) -> tuple[str, ...]:
    """Return the names that some kind of gear set has in a field."""
    names = (name for kind in SETS.values() for name in getattr(kind, field))
    return tuple(dict.fromkeys(names))


UNSAID = SetDescriptor(
    kind="",
    members=_any("members"),
    toothed=_any("toothed"),
    flanks=_any("flanks"),
    meshes=_any("meshes"),
    sections=("",),
    central=_any("central"),
    roles=(),
)
"""What is known where no kind is said: any name that some kind has, and no default
roles."""
