"""A small pair under load, for tests of what moves in it."""

PAIR = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "face_width": "20 mm",
        "pinion": {"teeth": 23},
        "gear": {"teeth": 37},
    },
    "operation": {"torque": "150 N*m", "speed": "2900 rpm"},
    "mesh": {"damping_ratio": 0.05},
    "dynamics": {"model": "torsional"},
}
