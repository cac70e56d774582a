"""Circumstances that no command chooses: ``python
tests/benchmarks/faults/circumstances.py [KIND …]``.

Kinds: ``streams`` (standard streams closed, full, or their reader gone, for every
command), ``umask``, ``temporary`` (a full temporary folder), ``users`` (a store and
locks of another user; as root only), ``clock`` (the clock jumps while a campaign runs;
needs a C compiler). Survived is what ends as undisturbed or in one message, with status
0, 1 or 2 and no traceback; of outputs that nobody reads any more, status 1 or that of
the undisturbed command. Prints one line a kind and every fault that was not survived.
"""

import contextlib
import os
import random
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))

import fake_campaign
import scenes
from storm import begin, done, finish, reference

from wearlab.cli.app import main

ROOT = Path(__file__).parents[3]
NOBODY = 65534
LONGEST = 120.0
WILD = 20
STUDY = (
    scenes.TWO_TORQUES
    + """
[[figure]]
kind = "max-wear"
"""
)


class Tally:
    """What was tried and what was not survived."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.tried = 0
        self.faults = []

    def judge(self, what: str, well: bool, said: object = "") -> None:
        self.tried += 1
        if not well:
            self.faults.append(f"{self.kind}: {what}: {str(said)[-400:]}")

    def tell(self) -> bool:
        print(
            f"{self.kind}: {self.tried} tried, {self.tried - len(self.faults)} "
            "survived",
            flush=True,
        )
        for fault in self.faults[:20]:
            print(" ", fault)
        return not self.faults


def closed(*numbers):
    def shape(ends):
        for number in numbers:
            os.close(number)

    return shape


def full(number):
    def shape(ends):
        os.dup2(os.open("/dev/full", os.O_WRONLY), number)

    return shape


def deserted(*numbers):
    def shape(ends):
        reader, writer = os.pipe()
        os.close(reader)
        for number in numbers:
            os.dup2(writer, number)
        os.close(writer)

    return shape


SHAPES = {
    ">&-": closed(1),
    "2>&-": closed(2),
    "<&-": closed(0),
    "<&- >&- 2>&-": closed(0, 1, 2),
    ">/dev/full": full(1),
    "2>/dev/full": full(2),
    "| true": deserted(1),
    "2>&1 | true": deserted(1, 2),
}


def forked(words, shape=None, **options) -> tuple[int, str]:
    """Run a command in a process that begins as the shell would begin it.

    Return status and what it said.
    """
    with tempfile.TemporaryFile("w+") as said:
        child = begun(words, said, shape, **options)
        deadline = time.monotonic() + LONGEST
        while (ended := os.waitpid(child, os.WNOHANG))[0] == 0:
            if time.monotonic() > deadline:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
                return -1, f"did not end in {LONGEST:.0f} s"
            time.sleep(0.01)
        said.seek(0)
        return os.waitstatus_to_exitcode(ended[1]), said.read()


def begun(words, said, shape=None, umask=None) -> int:
    """Fork a command.

    Standard error goes to ``said`` unless the shape says otherwise.
    """
    sys.stdout.flush()
    child = os.fork()
    if child:
        return child
    os.dup2(os.open(os.devnull, os.O_RDWR), 0)
    os.dup2(said.fileno(), 1)
    os.dup2(said.fileno(), 2)
    if umask is not None:
        os.umask(umask)
    if shape is not None:
        shape(None)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
            stream = open(number, "r" if number == 0 else "w", closefd=False)
        except OSError:
            stream = None
        setattr(sys, name, stream)
    status = 70
    try:
        sys.argv = ["wearlab", *map(str, words)]
        main()
    except SystemExit as left:
        status = left.code
    except BaseException:
        import traceback

        with contextlib.suppress(Exception):
            traceback.print_exc()
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except OSError:
            status = 120  # as Python would end
    os._exit(status)


def commands(folder: Path, file: Path, store: Path) -> list[list[object]]:
    """Return every command on a store that holds the runs of a file,
    those that read first.
    """
    here = ["--store", store]
    merged = folder / "merged"
    two = [case.id for case in _cases(file)]
    drawn = folder / "drawn"
    flank = folder / "flank.csv"
    flank.write_text(
        "roll_angle [deg],deviation [um]\n"
        + "".join(f"{a},{0.1 * a}\n" for a in range(8, 30))
    )
    return [
        *(["--help"], ["--version"], ["ls", "--help"], ["nonsense"], []),
        *(
            ["check", file],
            ["plan", file, *here],
            ["run", file, *here],
            ["run", "--json", file, *here],
        ),
        *(
            ["ls", *here],
            ["ls", "--json", *here],
            ["ls", "--format", "csv", *here],
            ["show", two[0], *here],
        ),
        *(
            ["show", "zzz", *here],
            ["compare", *two, *here],
            ["figures", file, "--out", drawn, *here],
        ),
        *(
            ["report", file, "--out", folder / "page.html", *here],
            ["modes", file],
            ["schema"],
        ),
        *(
            ["variables"],
            ["features", *here],
            ["cite", two[0], *here],
            ["verify", *here],
        ),
        *(
            ["export", file, folder / "all.nc", *here],
            ["merge", store, "--store", merged],
        ),
        *(
            ["pull", store, "--store", merged],
            ["push", merged, *here],
            ["prune", *here],
        ),
        *(["reindex", *here],),
        *(
            ["new", "fzg", "--out", folder / "begun.toml"],
            ["profile", flank],
            ["update", file, *here],
        ),
    ]


def _cases(file):
    import wearlab

    return wearlab.load(file).cases


def study(folder: Path) -> tuple[Path, Path]:
    """Return a campaign file and a store with its runs."""
    import wearlab

    folder.mkdir(exist_ok=True)
    file = folder / "study.toml"
    store = folder / "store"
    file.write_text(STUDY)
    for case in wearlab.load(file).cases:
        wearlab.run([case.scene], store, progress=False)
    wearlab.run(file, store, progress=False)
    return file, store


def streams(folder: Path) -> Tally:
    tally = Tally("streams")
    file, store = study(folder)
    os.chdir(folder)
    for words in commands(folder, file, store):
        plain, said = forked(words)
        tally.judge(
            f"{words}", plain in (0, 1, 2) and "Traceback" not in said, (plain, said)
        )
        for name, shape in SHAPES.items():
            (folder / "begun.toml").unlink(missing_ok=True)
            status, said = forked(words, shape)
            may = (
                {plain}
                if name in (">&-", "2>&-", "<&-", "<&- >&- 2>&-", "2>/dev/full")
                else {plain, 1}
            )
            strange = [
                word for word in ("Traceback", "Exception ignored") if word in said
            ]
            tally.judge(
                f"{' '.join(map(str, words))} {name}",
                status in may and not strange,
                (status, said),
            )
    return tally


def umask(folder: Path) -> Tally:
    tally = Tally("umask")
    file, _ = study(folder)
    for mask in (0o077, 0o000, 0o777 & ~0o700, 0o027):
        store = folder / f"masked-{mask:03o}"
        for words in (
            ["run", file],
            ["ls"],
            ["verify"],
            ["reindex"],
            ["run", file],
            ["prune"],
        ):
            status, said = forked([*words, "--store", store], umask=mask)
            tally.judge(
                f"{mask:03o} {words[0]}",
                (status, "Traceback" in said) == (0, False),
                (status, said),
            )
        beyond = [
            f"{path} {stat.filemode(path.stat().st_mode)}"
            for path in store.rglob("*")
            if path.stat().st_mode & mask
        ]
        tally.judge(f"{mask:03o} modes", not beyond, beyond)
    return tally


def temporary(folder: Path) -> Tally:
    tally = Tally("temporary")
    file, store = study(folder)
    small = folder / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k,mode=1777", "tmpfs", str(small)]
    if subprocess.run(mount, capture_output=True).returncode:
        print(
            "temporary: mounting a small file system is not permitted; a folder that "
            "is not there instead"
        )
        small = folder / "none"
    else:
        with contextlib.suppress(OSError):
            (small / "filling").write_bytes(bytes(200_000))
    try:
        two_workers = ["run", file, "--workers", "2", "--store", folder / "new"]
        for words in (two_workers, *commands(folder, file, store)):
            shutil.rmtree(folder / "new", ignore_errors=True)
            plain, _ = forked(words)
            (folder / "begun.toml").unlink(missing_ok=True)
            environment = {**os.environ, "TMPDIR": str(small)}
            code = "from wearlab.cli import main; main()"
            command = [sys.executable, "-c", code, *map(str, words)]
            ended = subprocess.run(
                command,
                env=environment,
                capture_output=True,
                text=True,
                timeout=LONGEST,
            )
            well = ended.returncode in {plain, 1, 2}
            tally.judge(
                " ".join(map(str, words)),
                well and "Traceback" not in ended.stderr,
                ended,
            )
    finally:
        if small.name == "small":
            subprocess.run(["umount", "--lazy", str(small)], check=True)
    return tally


def users(folder: Path) -> Tally:
    """Another user reads and writes a store while root computes into
    it, and after that was killed.
    """
    tally = Tally("users")
    if os.geteuid() != 0:
        print("users: only root can be two users")
        return tally
    os.chmod(folder, 0o777)
    for mask in (0o000, 0o022, 0o077):
        store = folder / f"store-{mask:03o}"
        gate = folder / f"gate-{mask:03o}"
        before = os.umask(mask)
        fake_campaign.filled(store, fake_campaign.sweep(3)).close()
        child = subprocess.Popen(
            [
                sys.executable,
                ROOT / "tests" / "support" / "run_fake.py",
                store,
                "4",
                "-",
                gate,
                "alone=1",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.umask(before)
        _until(lambda store=store: list((store / "runners").glob("*.lock")))
        time.sleep(1.0)
        for words in (
            ["ls"],
            ["verify"],
            ["show", "zz"],
            ["prune"],
            ["reindex"],
            ["ls", "--where", "life > 1"],
        ):
            status, said = _as_nobody(
                "-c", "from wearlab.cli import main; main()", *words, "--store", store
            )
            well = status in (0, 1, 2) and "Traceback" not in said
            tally.judge(f"{mask:03o} held: {words[0]}", well, (status, said))
        child.kill()
        child.wait()
        gate.write_text("")
        script = ROOT / "tests" / "support" / "run_fake.py"
        status, said = _as_nobody(script, store, 4, "-", gate, "alone=1")
        tally.judge(
            f"{mask:03o} left behind: run", _goes_on(status, said, mask), (status, said)
        )
    return tally


def _as_nobody(*words: object) -> tuple[int, str]:
    """Run Python as another user."""
    command = [
        "setpriv",
        f"--reuid={NOBODY}",
        f"--regid={NOBODY}",
        "--clear-groups",
        sys.executable,
    ]
    try:
        ended = subprocess.run(
            [*command, *map(str, words)],
            capture_output=True,
            text=True,
            timeout=LONGEST,
            cwd="/",
        )
    except subprocess.TimeoutExpired:
        return -1, "waits for ever"
    return ended.returncode, f"{ended.stdout}\n{ended.stderr}".strip()


def _goes_on(status: int, said: str, mask: int) -> bool:
    """Say whether a store open to all was completed, and any other
    was refused in one message.
    """
    if mask == 0:
        return status == 0
    return status == 2 and "Traceback" not in said


def _until(happens) -> None:
    deadline = time.monotonic() + LONGEST
    while not happens():
        assert time.monotonic() < deadline, "nothing happened"
        time.sleep(0.05)


def clock(folder: Path, count: int = 400, seed: int = 1) -> Tally:
    """Let the clock jump by up to decades, both ways, while two workers compute.

    At last back only.
    """
    tally = Tally("clock")
    if shutil.which("cc") is None:
        print("clock: needs a C compiler, cc")
        return tally
    library = folder / "jumping_clock.so"
    now = folder / "now"
    source = ROOT / "tests" / "support" / "jumping_clock.c"
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O2", "-o", library, source, "-ldl"], check=True
    )
    now.write_bytes(bytes(8))
    whole = reference(folder / "quiet", count, folder / "jumping.log", act="slow")
    with _environment(LD_PRELOAD=str(library), JUMPING_CLOCK=str(now)):
        child = begin(folder / "jumping", count, folder / "jumping.log", act="slow")
    jumps = _jumps(child, now, random.Random(seed))
    status, said = finish(child)
    tally.judge(
        f"{jumps} jumps",
        (status, said) == (0, f"computed {count} of {count}"),
        (status, said),
    )
    tally.judge("results", done(folder / "jumping") == whole)
    tally.tried += jumps - 1
    return tally


def _jumps(child: subprocess.Popen[str], now: Path, dice: random.Random) -> int:
    """Set the clock by up to twenty years, both ways, then a day further back each
    time; return how often.
    """
    day = 86400
    jumps = 0
    deadline = time.monotonic() + LONGEST
    with now.open("r+b", buffering=0) as file:
        while child.poll() is None and time.monotonic() < deadline:
            wild = jumps < WILD
            by = (
                dice.choice((-1, 1)) * dice.choice((1, 3600, 400 * day, 7300 * day))
                if wild
                else -jumps * day
            )
            os.pwrite(file.fileno(), by.to_bytes(8, sys.byteorder, signed=True), 0)
            jumps += 1
            time.sleep(dice.uniform(0.05, 0.5) if wild else 0.01)
    if child.poll() is None:
        child.kill()
    return jumps


@contextlib.contextmanager
def _environment(**values: str):
    """Begin processes with other environment variables."""
    before = dict(os.environ)
    os.environ.update(values)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


KINDS = {
    "streams": streams,
    "umask": umask,
    "temporary": temporary,
    "users": users,
    "clock": clock,
}


def attack(kinds: list[str]) -> int:
    well = True
    for kind in kinds or list(KINDS):
        with tempfile.TemporaryDirectory() as folder:
            well &= KINDS[kind](Path(folder)).tell()
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(attack(sys.argv[1:]))
