"""Run files of strangers.

``python tests/benchmarks/faults/datasets.py [NAME … | PART/PARTS]``

Without words all are tried.

Each is a sound run's file with one hostile thing in it: attributes and dimensions that
are huge, of strange types, or that refer to themselves. The catalogue has its hash. It
is read whole and lazily, verified, merged, taken in by ``reindex``, and taken in
without a catalogue, each time in a process of its own. Survived is a result or one
short message, within ten seconds of processor time and 1 GB of memory beyond that of
the process.
"""

import os
import resource
import shutil
import signal
import sqlite3
import sys
import tempfile
import traceback
from contextlib import closing
from pathlib import Path

import h5py
import netCDF4
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))

import made_up

from wearlab.store import Store, StoreError
from wearlab.store.files import hash_of
from wearlab.store.merging import merge

RUN = "a" * 20
CAMPAIGN = made_up.Campaign((made_up.Case("base", RUN),))
SECONDS, ROOM = 10.0, 1_000_000_000
TEXT = h5py.string_dtype()
LARGE = "x" * 20_000_000


def netcdf(change):
    def apply(path):
        with netCDF4.Dataset(path, "a") as file:
            change(file)

    return apply


def hdf5(change):
    def apply(path):
        with h5py.File(path, "a", libver="latest") as file:
            change(file)

    return apply


def attribute(name, value, of="wear_depth"):
    """Set an attribute of a variable, of the whole file where ``of`` is empty."""
    return netcdf(lambda file: (file[of] if of else file).setncattr(name, value))


def attributes(**values):
    return netcdf(lambda file: file["wear_depth"].setncatts(values))


def raw(name, value, of="wear_depth"):
    """Set an attribute past netCDF's own rules."""
    return hdf5(lambda file: (file[of] if of else file).attrs.__setitem__(name, value))


def typed(name, shape, dtype, of="wear_depth"):
    """Make an attribute of a type, not filled."""
    return hdf5(
        lambda file: (file[of] if of else file).attrs.create(
            name, np.zeros(shape, dtype), dtype=dtype
        )
    )


def dimension(name, size):
    return netcdf(lambda file: file.createDimension(name, size))


def variable(name, dtype, dims, sizes=(), values=None, **options):
    """Make a variable, and the dimensions that it lacks."""

    def change(file):
        for dim, size in zip(dims, sizes, strict=False):
            if dim not in file.dimensions:
                file.createDimension(dim, size)
        made = file.createVariable(name, dtype, dims, **options)
        if values is not None:
            made[...] = values

    return netcdf(change)


def dataset(name, shape, dtype, **options):
    """Make a variable of HDF5 alone."""
    return hdf5(lambda file: file.create_dataset(name, shape, dtype, **options))


def one_text_many_times(count):
    """Let each element of an array of texts refer to one and the same large text."""

    def apply(path):
        with h5py.File(path, "a") as file:
            made = file.create_dataset("echo", (count,), TEXT)
            made[:] = "y"
            made[0] = LARGE
            at = made.id.get_offset()
        content = bytearray(path.read_bytes())
        content[at : at + 16 * count] = content[at : at + 16] * count
        path.write_bytes(content)

    return apply


def one_attribute_many_times(count):
    """The same within an attribute."""

    def apply(path):
        with h5py.File(path, "a") as file:
            file["wear_depth"].attrs.create(
                "echo", [LARGE, *[f"{i:08d}" for i in range(count - 1)]], dtype=TEXT
            )
        content = path.read_bytes()
        mark = len(LARGE).to_bytes(4, "little")
        at = next(
            place
            for place in _places(content, mark)
            if content[place + 16 : place + 20] == (8).to_bytes(4, "little")
        )
        changed = bytearray(content)
        changed[at : at + 16 * count] = content[at : at + 16] * count
        path.write_bytes(changed)

    return apply


def _places(content, mark):
    at = content.find(mark)
    while at >= 0:
        yield at
        at = content.find(mark, at + 1)


def own_reference(file):
    """Let a variable's attribute refer to itself, and its dimension list to itself."""
    one = file["wear_depth"]
    one.attrs.create("me", one.ref, dtype=h5py.ref_dtype)
    file.attrs.create("root", [file.ref, one.ref], dtype=h5py.ref_dtype)


def dimension_circle(file):
    """Let a variable's dimension be the variable itself."""
    one = file["wear_depth"]
    del one.attrs["DIMENSION_LIST"]
    lists = np.empty(one.ndim, object)
    lists[:] = [np.array([one.ref], h5py.ref_dtype)] * one.ndim
    one.attrs.create("DIMENSION_LIST", lists, dtype=h5py.vlen_dtype(h5py.ref_dtype))


def wrong_dimension(file):
    """Let a variable have the dimensions of another, of other lengths."""
    one = file["wear_depth"]
    other = file["phase"]
    del one.attrs["DIMENSION_LIST"]
    lists = np.empty(one.ndim, object)
    lists[:] = [np.array([other.ref], h5py.ref_dtype)] * one.ndim
    one.attrs.create("DIMENSION_LIST", lists, dtype=h5py.vlen_dtype(h5py.ref_dtype))


def many_attributes(file):
    for i in range(40_000):
        file["wear_depth"].attrs[f"a{i}"] = i


def many_variables(file):
    for i in range(25_000):
        file.create_dataset(f"v{i}", (), "f8")


def many_dimensions(file):
    for i in range(15_000):
        file.createDimension(f"d{i}", 1)


def deep(file):
    group = file
    for _ in range(400):
        group = group.create_group("g")


def twice_deflated(file):
    """Zeros, deflated twice: a thousand times a thousand times fewer bytes."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((200_000_000,))
    plist.set_deflate(1)
    plist.set_deflate(1)
    space = h5py.h5s.create_simple((200_000_000,))
    one = h5py.h5d.create(file.id, b"zeros", h5py.h5t.NATIVE_DOUBLE, space, plist)
    one.write(h5py.h5s.ALL, h5py.h5s.ALL, np.zeros(200_000_000))


def wide_chunk(file):
    """One value in a chunk that holds 400 million."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((400_000_000,))
    plist.set_deflate(9)
    space = h5py.h5s.create_simple((1,), (h5py.h5s.UNLIMITED,))
    one = h5py.h5d.create(file.id, b"one", h5py.h5t.NATIVE_DOUBLE, space, plist)
    one.write(h5py.h5s.ALL, h5py.h5s.ALL, np.zeros(1))


def cut_scale(file):
    """Take the marks of dimensions from all of them."""
    for one in file.values():
        for name in ("CLASS", "NAME", "_Netcdf4Dimid", "_Netcdf4Coordinates"):
            one.attrs.pop(name, None)


COMPOUND = np.dtype([("a", "f8"), ("b", "i4")])
HOSTILE = {
    "a text of 60 MB": raw("comment", "x" * 60_000_000),
    "a text of 60 MB of the file": raw("title", "x" * 60_000_000, ""),
    "five million numbers": raw("numbers", np.zeros(5_000_000)),
    "a hundred thousand texts": raw("texts", np.array(["t"] * 100_000, object)),
    "many attributes": hdf5(many_attributes),
    "many variables": hdf5(many_variables),
    "many dimensions": netcdf(many_dimensions),
    "one text, many times": one_text_many_times(500),
    "one text of an attribute, many times": one_attribute_many_times(500),
    "a reference to itself": hdf5(own_reference),
    "a dimension that is the variable": hdf5(dimension_circle),
    "the dimensions of another": hdf5(wrong_dimension),
    "no marks of dimensions": hdf5(cut_scale),
    "groups, deep": hdf5(deep),
    "deflated twice": hdf5(twice_deflated),
    "a wide chunk": hdf5(wide_chunk),
    "a dimension of 2^40": dimension("vast", 2**40),
    "a dimension without end": dimension("endless", None),
    "a variable of 2^40 values": variable("vast", "f8", ("vast",), (2**40,)),
    "a product beyond 64 bits": variable(
        "vast", "i1", ("one", "two"), (2**40, 2**40), chunksizes=(1, 1000)
    ),
    "labels of a dimension of a million": variable(
        "wide", "f8", ("wide",), (1_000_000,), 0.0, zlib=True
    ),
    "labels of seven million": variable(
        "wide", "i1", ("wide",), (7_000_000,), 0, zlib=True
    ),
    "one dimension twice": variable("square", "f8", ("phase", "phase"), values=0.0),
    "thirty dimensions": variable(
        "cube", "f8", tuple(f"d{i}" for i in range(30)), (1,) * 30, 0.0
    ),
    "no length": variable("none", "f8", ("nil",), (0,)),
    "a coordinate of other dims": variable("cycle2", "f8", ("vast",), (5,), 0.0),
    "a strange name": dataset("a b\u202e{}%s\n", (3,), "f8"),
    "a name of 250 letters": variable("n" * 250, "f8", ("phase",), values=0.0),
    "own type: compound": dataset("pairs", (3,), COMPOUND),
    "own type: enum": dataset("flags", (3,), h5py.enum_dtype({"a": 1})),
    "own type: opaque": dataset("void", (3,), "V16"),
    "own type: arrays": dataset("lines", (3,), np.dtype(("f8", (4,)))),
    "own type: lists": dataset("lists", (3,), h5py.vlen_dtype("f8")),
    "own type: references": dataset("references", (3,), h5py.ref_dtype),
    "own type: regions": dataset("regions", (3,), h5py.regionref_dtype),
    "own type: half": dataset("half", (3,), "f2"),
    "own type: half, big-endian": dataset("half", (3,), ">f2"),
    "own type: long double": dataset("long", (3,), np.longdouble),
    "an attribute, half": typed("half", (2,), "f2"),
    "an attribute, half, of the file": typed("half", (2,), "f2", ""),
    "an attribute, long double": typed("long", (), np.longdouble),
    "an attribute, complex": typed("complex", (2,), "c16"),
    "own type: complex": dataset("complex", (3,), "c16"),
    "an attribute, compound": typed("pair", (2,), COMPOUND),
    "an attribute, enum": typed("flag", (2,), h5py.enum_dtype({"a": 1})),
    "an attribute, opaque": typed("void", (2,), "V16"),
    "an attribute, compound, of the file": typed("pair", (2,), COMPOUND, ""),
    "an empty attribute": raw("nothing", h5py.Empty("f8")),
    "a matrix": raw("matrix", np.zeros((3, 3))),
    "bytes that are no text": raw("comment", np.bytes_(b"\xff\xfe\x80")),
    "bytes that are no text, of the file": raw("title", np.bytes_(b"\xff\xfe\x80"), ""),
    "scale of text": attribute("scale_factor", "x"),
    "scale of many": attribute("scale_factor", np.ones(3)),
    "offset of text": attribute("add_offset", "x"),
    "scale and offset": attributes(scale_factor=1e308, add_offset=1e308),
    "fill of another type": raw("_FillValue", "x"),
    "missing of many": attribute("missing_value", np.arange(5.0)),
    "missing of text": attribute("missing_value", "none"),
    "unsigned": attribute("_Unsigned", "true"),
    "a bool of halves": attribute("dtype", "bool"),
    "a type of nothing": attribute("dtype", "O"),
    "a type of a class": attribute("dtype", "os.system"),
    "days": attribute("units", "days since 1970-01-01"),
    "days long ago": attribute("units", "days since 0000-00-00"),
    "seconds of no date": attribute("units", "seconds since x"),
    "days of another calendar": attributes(units="days since 1970-1-1", calendar="x"),
    "microseconds": attribute("units", "microseconds"),
    "units of number": attribute("units", 5.0),
    "units of many": attribute("units", ["m"] * 1000),
    "coordinates of itself": attribute("coordinates", "wear_depth wear_depth"),
    "coordinates of number": attribute("coordinates", 5.0),
    "a million coordinates": attribute("coordinates", "c " * 1_000_000),
    "coordinates of the file": attribute("coordinates", "a b c", ""),
    "a grid mapping": attribute("grid_mapping", "wear_depth: wear_depth"),
    "bounds of itself": attribute("bounds", "wear_depth"),
    "a compression by gathering": attribute("compress", "wear_depth"),
    "another id": attribute("id", "b" * 20, ""),
    "an id of number": attribute("id", 5.0, ""),
    "a scene that is none": attribute("scene", "{{{", ""),
    "a scene of brackets": attribute("scene", "[" * 100_000, ""),
    "a scene of number": attribute("scene", 5.0, ""),
    "a scene of objects": attribute("scene", '{"a":' * 3000 + "1" + "}" * 3000, ""),
    "a date of numbers": attribute("date_created", np.arange(3.0), ""),
    "a source of numbers": attribute("source_hash", np.arange(3.0), ""),
    "a calibration of text": attribute("calibration_life", "x" * 1000, ""),
    "a seal of number": attribute("content_sha256", 5.0, ""),
    "a seal of many": attribute("content_sha256", np.arange(5.0), ""),
    "times of many": variable("run_time_total", "f8", ("phase",), values=1.0),
    "times of text": variable("run_time_total", str, (), values=np.array("x", object)),
}


def acts(folder):
    """Return what is done with a store in ``folder / "store"``."""

    def store():
        return closing(Store(folder / "store"))

    def whole():
        with store() as one:
            one.run(RUN)

    def lazily():
        with store() as one:
            grid = one.open(CAMPAIGN)
            for name in ("wear_depth", "verdict", "echo", "zeros", "one"):
                if name in grid:
                    grid[name].load()

    def verify():
        with store() as one:
            one.verify()

    def merged():
        with store() as one, closing(Store(folder / "into")) as into:
            merge(into, one)
            into.verify()

    def reindex():
        with store() as one:
            one.reindex()
            one.archive.entries()
            one.query("speed > 0 rpm")

    def found():
        (folder / "store" / "catalogue.sqlite").unlink()
        reindex()

    return {
        "run": whole,
        "open": lazily,
        "verify": verify,
        "merge": merged,
        "reindex": reindex,
        "found": found,
    }


def judged(act) -> str:
    """Return what is wrong with an act, "" when nothing is.

    Done in a process of its own.
    """
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        said = _done(act)
        os.write(writer, said.encode(errors="replace")[:4000])
        os._exit(0)
    os.close(writer)
    with open(reader, "rb") as pipe:
        said = pipe.read().decode()
    _, status, used = os.wait4(child, 0)
    taken = 1024 * used.ru_maxrss - _resident()
    if status:
        return f"ended by signal {signal.Signals(os.WTERMSIG(status)).name}, or memory"
    if used.ru_utime + used.ru_stime > SECONDS:
        return f"took {used.ru_utime + used.ru_stime:.0f} s"
    return said or (f"took {taken / 1e6:.0f} MB" if taken > ROOM else "")


def _resident() -> int:
    """Return the memory of this process [bytes]."""
    with open("/proc/self/statm") as told:
        return int(told.read().split()[1]) * os.sysconf("SC_PAGESIZE")


def _done(act) -> str:
    with open("/proc/self/statm") as told:
        now = int(told.read().split()[0]) * os.sysconf("SC_PAGESIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + 3 * ROOM, now + 3 * ROOM))
    resource.setrlimit(resource.RLIMIT_CPU, (int(3 * SECONDS), int(3 * SECONDS)))
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    try:
        act()
    except StoreError as error:
        return f"says {len(str(error))} letters" if len(str(error)) > 1000 else ""
    except BaseException as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return (
            f"{type(error).__name__}: {str(error)[:200]} "
            f"({where.filename}:{where.lineno})"
        )
    return ""


def prepared(folder, craft) -> bool:
    """Make a store whose run has a crafted file, its hash in the catalogue.

    Say whether it could be made.
    """
    folder.mkdir()
    with closing(Store(folder / "store")) as store:
        store.archive.create()
        made_up.put(store, RUN, made_up.run(800.0), scene='{"operation":{"speed":3.0}}')
        store.archive.catalogue.record_campaign(
            "t", None, "x.toml", [(RUN, "base", {})]
        )
        path = store.archive.files.path(RUN)
        store.run(RUN).to_netcdf(
            path
        )  # ours lack the order of creation, without which netCDF does not append
        store.close()
        if not crafted(craft, path):
            return False
        with closing(
            sqlite3.connect(store.archive.catalogue.path, isolation_level=None)
        ) as connection:
            connection.execute(
                "UPDATE runs SET sha256 = ?, size = ?",
                (hash_of(path), path.stat().st_size),
            )
    return True


def crafted(craft, path) -> bool:
    """Say whether a file could be changed so, in a process of its
    own: failures leave files open.
    """
    child = os.fork()
    if child == 0:
        try:
            craft(path)
            os._exit(0)
        except BaseException as error:
            print(f"  cannot be made: {type(error).__name__}: {error}", flush=True)
            os._exit(1)
    return os.waitpid(child, 0)[1] == 0


def attack(names, folder) -> tuple[int, list[str]]:
    """Return how many acts were tried, and the faults; each is told at once."""
    tried = 0
    faults = []
    for number, name in enumerate(names):
        here = Path(folder) / str(number)
        if not prepared(here, HOSTILE[name]):
            faults.append(f"{name}: cannot be made")
            print(" ", faults[-1], flush=True)
            continue
        for what, act in acts(here).items():
            tried += 1
            if said := judged(act):
                faults.append(f"{name}: {what}: {said}")
                print(" ", faults[-1], flush=True)
        shutil.rmtree(here)
    return tried, faults


def chosen(words: list[str]) -> list[str]:
    """Return the names that are asked for: those given, a part of all, or all."""
    if len(words) == 1 and "/" in words[0]:
        part, parts = map(int, words[0].split("/"))
        return list(HOSTILE)[part - 1 :: parts]
    return words or list(HOSTILE)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        tried, faults = attack(chosen(sys.argv[1:]), folder)
    print(f"datasets: {tried} tried, {tried - len(faults)} survived")
    sys.exit(1 if faults else 0)
