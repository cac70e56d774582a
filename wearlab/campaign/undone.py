"""Values that a file sets back because it is extended twice: the order of ``extends`` undoes them silently.

Of several files that are extended the later one counts more, with all that it extends itself. A base file
that is reached again through a later one so sets its values over those that an earlier one had changed.
"""

from collections.abc import Iterator, Sequence

from wearlab.campaign.axes import flat, overlap
from wearlab.campaign.inheritance import Layer
from wearlab.scene.problems import shown

TOLD_ELSEWHERE = ("title", "reference", "figure", "sweep", "case", "metadata", "report", "exclude")


def undone(layers: Sequence[Layer]) -> Iterator[str]:
    """Yield what files that are extended twice set back, one line each.

    Parameters
    ----------
    layers : the files of a campaign, the one that counts most last
    """
    for again, layer in enumerate(layers):
        first = next(i for i, other in enumerate(layers) if other.file == layer.file)
        if first == again:
            continue
        for key, value in _values(layer):
            between = [layer for layer in layers[first + 1 : again] if _sets_otherwise(layer, key, value)]
            later = any(overlap(key, other) for layer in layers[again + 1 :] for other, _ in _values(layer))
            if between and not later:
                other = between[-1].file.name
                yield (
                    f"extends: {layer.file.name} is reached again after {other} and sets {key} "
                    f"back to {shown(value)}: put {other} last"
                )


def _values(layer: Layer) -> list[tuple[str, object]]:
    sections = {name: own for name, own in layer.table.items() if name not in TOLD_ELSEWHERE}
    return list(flat(sections).items())


def _sets_otherwise(layer: Layer, key: str, value: object) -> bool:
    return any(overlap(key, other) and (other, own) != (key, value) for other, own in _values(layer))
