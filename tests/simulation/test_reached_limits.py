"""What a run says where deflection takes contact beyond the computed nodes."""

import numpy as np
import pytest

from wearlab import assembly
from wearlab.assembly.contact import follows_extended_contact, reached_limits
from wearlab.scene import Scene

PAIR = {
    "gears": {
        "kind": "internal-pair",
        "module": "1.25 mm",
        "face_width": "14 mm",
        "pinion": {"teeth": 26},
        "ring": {"teeth": 66, "rim_diameter": "95 mm"},
    },
    "operation": {"torque": "2 N*m", "speed": "1500 rpm"},
    "numerics": {"profile_points": 61, "phase_points": 32},
}


@pytest.fixture
def kind_of():
    """Build the only kind of mesh of the pair, with or without extended contact."""

    def build(extended):
        scene = Scene.from_mapping(PAIR | {"mesh": {"extended_contact": extended}})
        return assembly.build(scene).kinds[0]

    return build


def messages(kind, wear, gap, deflection):
    grid = kind.analysis.grid
    return list(
        reached_limits(
            kind.pair,
            kind.analysis,
            wear * np.ones((2, len(grid.position))),
            np.full(len(grid.contact_position), gap),
            np.full(len(grid.phase_nodes[0]), deflection),
        )
    )


def test_extended_contact_is_cut_off_where_an_outermost_gap_closes(kind_of):
    kind = kind_of(extended=True)
    assert follows_extended_contact(kind.analysis)
    assert messages(kind, 0.0, gap=25e-6, deflection=24e-6) == []
    assert messages(kind, 0.0, gap=25e-6, deflection=26e-6) == [
        "extended contact is cut off at a deflection of 26 µm"
    ]


def test_contact_that_ends_at_a_and_e_says_how_far_deflection_would_extend_it(kind_of):
    kind = kind_of(extended=False)
    assert not follows_extended_contact(kind.analysis)
    assert messages(kind, 0.0, gap=0.0, deflection=0.0) == []
    (message,) = messages(kind, 0.0, gap=0.0, deflection=1e-3)
    assert message.startswith("deflection would extend the path of contact by ")


def test_flanks_worn_too_steeply_have_no_extension_that_could_be_told(kind_of):
    kind = kind_of(extended=False)
    count = len(kind.analysis.grid.position)
    step = np.where(np.arange(count) == count // 2, 1e-3, 0.0)
    assert messages(kind, step, gap=0.0, deflection=1e-5) == [
        "flanks are worn too steeply to tell how far deflection extends their contact"
    ]
