"""A catalogue of very many runs, written at once: rows as `wearlab.store` writes them,
without any file.
"""

import json

from wearlab.query import keys
from wearlab.store import Store

SOURCES = {
    "operation.torque": "scene",
    "operation.speed": "scene",
    "verdict": "result",
    "life": "result",
    "service_life": "result",
    "max_wear_depth": "result",
}


def values(number):
    """Return what a run of a number came to: every one another torque and life."""
    torque = 100.0 + number % 500
    life = 1e8 * (1.0 + (number * 7919) % 100_003 / 1e5)
    return {
        "operation.torque": torque,
        "operation.speed": 100.0,
        "verdict": "completed",
        "life": life,
        "service_life": 0.06 * life,
        "max_wear_depth": 2e-5,
    }


def run_id(number):
    return f"{number:020x}"


def filled(path, count, title="Very many"):
    """Return a store whose catalogue has ``count`` runs of one campaign."""
    store = Store(path)
    store.archive.create()
    scene = json.dumps({"operation": {"torque": 1.0}})
    with store.archive.catalogue._transaction() as connection:
        for at, (name, source) in enumerate(SOURCES.items(), 1):
            key = keys.key_of(name, source, "text" if name == "verdict" else "number")
            told = (
                at,
                name,
                source,
                key.kind,
                key.unit,
                key.quantity,
                key.display_unit,
            )
            connection.execute("INSERT INTO keys VALUES (?, ?, ?, ?, ?, ?, ?)", told)
        connection.executemany(
            "INSERT INTO runs VALUES (?, ?, 'failed', NULL, NULL, NULL, ?, 1.0, "
            "'abc', '0.1', NULL)",
            (
                (n, run_id(n), f"2026-11-{1 + n % 28:02d}T00:00:00.000+00:00")
                for n in range(1, count + 1)
            ),
        )
        connection.executemany(
            "INSERT INTO documents VALUES (?, 'made up', '[]', '{}', '{}', ?, ?)",
            ((n, json.dumps(values(n)), scene) for n in range(1, count + 1)),
        )
        for at, name in enumerate(SOURCES, 1):
            rows = ((at, n, values(n)[name]) for n in range(1, count + 1))
            connection.executemany("INSERT INTO facts VALUES (?, ?, ?)", rows)
    members = [
        (run_id(n), "base", {"torque": f"{100 + n % 500} N*m"})
        for n in range(1, count + 1)
    ]
    store.archive.catalogue.record_campaign(title, None, None, members)
    return store
