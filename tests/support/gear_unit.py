"""The pair of a gear unit whose flanks have a width: what tests of faces begin from."""

from typing import Any

GEAR_UNIT: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "4 mm",
        "face_width": "45 mm",
        "pinion": {"teeth": 23},
        "gear": {"teeth": 71},
    },
    "operation": {"torque": "320 N*m", "speed": "1450 rpm"},
}
