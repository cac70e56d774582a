"""The checksum that a run's file carries inside: what it says can be checked without any catalogue."""

import hashlib
import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

SEAL = "content_sha256"
PASSING = ("run_time_", "date_", "history")  # another time each time the same run is computed
CIRCUMSTANCES = ("machine", "packages", "commit", "dirty", "source_hash", "wearlab_version", "source")


def sealed(dataset: "xr.Dataset") -> "xr.Dataset":
    """Return a dataset with the hash of its content among its attributes."""
    return dataset.assign_attrs({SEAL: content_hash(dataset)})


def is_intact(dataset: "xr.Dataset") -> bool | None:
    """Say whether a dataset is what was sealed; None when it bears no seal."""
    seal = dataset.attrs.get(SEAL)
    return None if seal is None else seal == content_hash(dataset)


def content_hash(dataset: "xr.Dataset") -> str:
    """Return the SHA-256 over every variable's name, dims, values and attributes, and the global attributes.

    Numbers are hashed as little-endian bytes of their stored type, texts as JSON: the hash does not depend on
    compression or on the version of the file format. Run times and dates are left out: the same run computed
    twice by the same code bears the same seal.
    """
    names = (name for name in map(str, dataset.variables) if not name.startswith(PASSING))
    attributes = (name for name in map(str, dataset.attrs) if not name.startswith((SEAL, *PASSING)))
    return _hash(dataset, names, attributes)


def results_hash(dataset: "xr.Dataset") -> str:
    """Return the SHA-256 over what a scene determines, whenever and wherever it was computed."""
    names = (name for name in map(str, dataset.variables) if not name.startswith(PASSING))
    attributes = (name for name in map(str, dataset.attrs) if not _is_circumstance(name))
    return _hash(dataset, names, attributes)


def _is_circumstance(name: str) -> bool:
    return name == SEAL or name in CIRCUMSTANCES or name.startswith(PASSING)


def _hash(dataset: "xr.Dataset", names: Iterable[str], attributes: Iterable[str]) -> str:
    digest = hashlib.sha256()
    for name in sorted(names):
        variable = dataset.variables[name]
        digest.update(_json([name, list(variable.dims), list(variable.shape), _plain(variable.attrs)]))
        digest.update(_bytes(np.asarray(variable.values)))
    digest.update(_json({name: _plain(dataset.attrs[name]) for name in sorted(attributes)}))
    return digest.hexdigest()


def _bytes(values: Any) -> bytes:
    if values.dtype.kind in "OUS":
        return _json(values.tolist())
    stored = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return values.dtype.kind.encode() + bytes(np.ascontiguousarray(stored).data)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in sorted(value.items())}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return value


def _json(value: Any) -> bytes:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), default=str).encode()
