"""Output directories: the files that each verb writes there, the marker by which they are recognised, and the lock.

The marker of a directory has a claim for each verb that wrote into the directory. A claim has the job of the verb, and
the id of its run. Only files that the marker or a sealed checkpoint identifies are replaced; other files are refused or
renamed. A run takes the lock first. Then it checks the ownership of the directory, and only then it writes files.
"""

import errno
import fcntl
import json
import os
import secrets
import shutil
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ..capabilities import folders
from ..errors import InputError, InUseError
from ..job.reading import CASES
from ..parallel.slab import Slab
from . import checkpoint, files, hdf5

# sections in which all jobs of a directory must agree
SCENE = ("grid", "bands", "surface", "material", *(one.SECTION for one in folders() if hasattr(one, "IN_SCENE")))
_ADDED = {one.SECTION: one for one in folders() if hasattr(one, "SECTION")}
# sections and keys of effects that change completed steps
EFFECTS = tuple(key for one in _ADDED if one not in SCENE for key in getattr(_ADDED[one], "CHANGES_STEPS", (one,)))
SECTIONS = (*SCENE, *_ADDED, "initial", "numerics", "steady")  # sections of a job that a marker keeps


@dataclass(frozen=True)
class Outputs:
    """Names of the files that one verb writes; '' or () if it writes no such files.

    `words` is the name of the results in messages. A directory has results of the verb if it has the file `table`.
    Further files are `tables`, `maps` (HDF5), a `log` and `others`. `copies` are the job as given, and the job with
    every default.

    A verb with a directory of `checkpoints` continues from the newest checkpoint, and other verbs continue their table.
    The sections and keys `same` must then be the same in both jobs. `complete` is a sentence on a finished table; its
    {} stands for the last step or the number of points.
    """

    words: str
    table: str
    tables: tuple[str, ...] = ()
    maps: str = ""
    log: str = ""
    others: tuple[str, ...] = ()
    copies: tuple[str, ...] = ()
    checkpoints: str = ""
    same: tuple[str, ...] = ()
    complete: str = ""

    @property
    def written(self) -> tuple[str, ...]:
        """Names of all results, which a new start removes."""
        return tuple(filter(None, (self.table, *self.tables, self.maps, self.log, *self.others)))

    def changes(self, then: Mapping[str, Any], now: Mapping[str, Any]) -> str:
        """Return why results of the job `then` cannot be continued with the job `now`: a text on the differences of
        both jobs, or '' if the results can be continued. Both jobs are plain data."""
        return differences(then, now, self.same)

    @property
    def resolved(self) -> str:
        """Name of the job with every default."""
        return self.copies[-1]


STOP = "stop"  # name of the stop file of a run or a sweep
MARCHES = "checkpoint/marches.json"  # finished marches of bands
BANDS, WAVES, CYCLES = "bands.csv", "steady_waves.csv", "cycles.csv"
LOST = "steady.lost.json"  # points of a friction curve without a solution
SWEPT_CURVES = "sweep_curves.csv"  # the points of all friction curves of a sweep
STUDY_TEXT, STUDY_PICTURE = "study.txt", "convergence.png"
STEADY_THEORY, BANDS_THEORY = "steady_theory.csv", "bands_theory.csv"

RUN = Outputs(
    "a run",
    "measures.csv",
    tables=(CYCLES, BANDS),
    maps="fields.h5",
    log="run.log",
    others=("fields.xdmf", MARCHES),
    copies=("job.yaml", "job.resolved.yaml"),
    checkpoints="checkpoint",
    same=(*SCENE, *EFFECTS, "initial", *(f"numerics.{key}" for key in ("integrator", "kernel", "precision", "slope"))),
    complete="its run has finished with step {}",
)
STEADY = Outputs(
    "a friction curve",
    "steady.csv",
    tables=(WAVES, BANDS, STEADY_THEORY, BANDS_THEORY),
    maps="steady.h5",
    log="steady.log",
    others=(LOST,),
    copies=("steady.job.yaml", "steady.resolved.yaml"),
    same=(*SCENE, *EFFECTS, *(f"numerics.{key}" for key in ("kernel", "precision", "slope", "tolerance")), "steady"),
    complete="its curve has {} points",
)
SWEEP = Outputs("a sweep", "sweep.csv", tables=(SWEPT_CURVES, "sweep_mean.csv", "sweep_curves_mean.csv"))
STUDY = Outputs(
    "a study", "study.csv", others=(STUDY_TEXT, STUDY_PICTURE), copies=("study.job.yaml", "study.resolved.yaml")
)
THEORY = Outputs("a theory", "theory.csv", tables=(STEADY_THEORY, BANDS_THEORY), others=("theory.yaml",))
BY_VERB = {"run": RUN, "steady": STEADY, "sweep": SWEEP, "study": STUDY, "theory": THEORY}
LOGS, MAPS = (RUN.log, STEADY.log), (RUN.maps, STEADY.maps)


def find_checkpoints(directory: Path) -> list[tuple[int, Path]]:
    """Return steps and paths of the checkpoints in a directory of results, the newest first."""
    found = directory.glob(f"{RUN.checkpoints}/step-*.h5")
    return sorted(((int(path.stem[5:]), path) for path in found if path.stem[5:].isdecimal()), reverse=True)


MARKER, FORMAT = ".parcontact", 1
SHOWN = 4  # most differences of two jobs in a message


@dataclass(frozen=True)
class Claim:
    """Record of a command in an output directory.

    `job` has the sections of the job of this command, and `id` is the id of its run. `saved` is True after the first
    checkpoint. `finished` is the last step and its time [s], or for a curve the number of points and 0; it is None
    before the end. `detached` is a sentence on how the surfaces detached, or ''.
    """

    job: dict[str, Any]
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    saved: bool = False
    finished: tuple[int, float] | None = None
    detached: str = ""


def kept(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sections of a job (plain data) that are stored in the marker file."""
    return {name: data[name] for name in SECTIONS if name in data}


def read_claims(directory: Path) -> dict[str, Claim]:
    """Return the records of commands in a directory, by verb. The result is empty for a directory without a marker.
    Raises OSError or ValueError."""
    path = directory / MARKER
    try:
        text = path.read_bytes()
    except FileNotFoundError:
        return {}
    try:
        data = json.loads(text)
        newer = data.pop("format") > FORMAT
        if not newer:
            return {verb: Claim(**{**claim, "finished": _pair(claim["finished"])}) for verb, claim in data.items()}
    except (ValueError, TypeError, KeyError, AttributeError):
        raise ValueError(f"{path} is damaged") from None
    raise ValueError(f"{path} was written by a newer parcontact")


def sound_claims(directory: Path) -> dict[str, Claim]:
    """Return the records of commands in a directory, by verb. Raises InputError for an unreadable marker."""
    try:
        return read_claims(directory)
    except (OSError, ValueError) as error:
        raise InputError(str(error)) from error


def detached(directory: Path) -> str:
    """Return a sentence on how the surfaces of a run detached for good, or '' if they did not. Raises InputError."""
    claim = sound_claims(directory).get("run")
    return "" if claim is None else claim.detached


def _pair(value: Sequence[float] | None) -> tuple[int, float] | None:
    return None if value is None else (int(value[0]), float(value[1]))


def write_claims(directory: Path, claims: Mapping[str, Claim]) -> None:
    data = {"format": FORMAT, **{verb: asdict(claim) for verb, claim in claims.items()}}
    files.replace_file(directory / MARKER, json.dumps(data, indent=1) + "\n")


def differences(then: Mapping[str, Any], now: Mapping[str, Any], names: Sequence[str]) -> str:
    """Return a text on the first differences of two jobs (plain data) in the named sections (`grid`) or keys
    (`numerics.kernel`). The text states both values of each of these differences, and the number of further
    differences. Return '' if there is none."""
    old, new = dict(_leaves("", then)), dict(_leaves("", now))
    keys = (key for name in names for key in {**old, **new} if f"{key}.".startswith(f"{name}."))
    found = [f"{key} was {old.get(key)}, is {new.get(key)}" for key in keys if old.get(key) != new.get(key)]
    return "; ".join([*found[:SHOWN], *[f"and {len(found) - SHOWN} more"] * (len(found) > SHOWN)])


def keep_mesh(job: Mapping[str, Any], different: str) -> str:
    """Return advice on how to keep the mesh of a job (plain data) if the mesh differs from that of another job, else
    ''. `different` is a text on the differences of both jobs."""
    if "grid.points" not in different:
        return ""
    points = str(job["grid"]["points"]).replace(" ", "")
    return f"give --set grid.points={points} to keep its mesh, or "


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the values in nested mappings and lists by key, such as `surface.0.seed`."""
    if isinstance(value, list) and value and all(isinstance(part, dict) for part in value):
        value = dict(enumerate(value))
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(f"{name}.{key}" if name else str(key), inner)
    else:
        yield name, value


MAX_SECONDS_TO_RELEASE = 3.0  # tuning: longest wait for the lock of a killed run [s]
LOCK = ".lock"
PERMITTED = (STOP, *THEORY.written)  # may be there before the first run
SHOWN_NAMES = 4  # tuning: most names of files in a message
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
ADVICE = "give --restart never to start from the beginning, or --out for another directory"


class Directory:
    """An output directory. Only root accesses it; collective methods broadcast the result."""

    def __init__(self, path: Path, slab: Slab, verb: str = "run") -> None:
        self.path, self.slab, self.verb, self.outputs = path, slab, verb, BY_VERB[verb]
        self.claims: dict[str, Claim] = {}
        self._lock: int | None = None
        self._made: list[Path] = []

    @property
    def checkpoints(self) -> Path:
        return self.path / RUN.checkpoints

    @property
    def stop_file(self) -> Path:
        return self.path / STOP

    @property
    def claim(self) -> Claim | None:
        """Return, on root, the record of this command in the marker of the directory; None on other ranks."""
        return self.claims.get(self.verb)

    def checkpoint(self, step: int) -> Path:
        """Return the path of the checkpoint after a step."""
        return self.checkpoints / f"step-{step}.h5"

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Lock the directory within the context, and create it if it is missing. Collective. A created directory that
        is still empty at the end is removed."""
        try:
            self._on_root(self._lock_and_read)
            yield
        finally:
            self._release()

    def refuse_foreign(self, job: Path, data: Mapping[str, Any], afresh: bool) -> None:
        """Raise InputError for foreign files, or for results of another job than `data` (plain data). Collective."""

        def look() -> None:
            if not self.claims and not afresh and not self._has_checkpoints():
                hint = ", or --restart never to write here and rename files of these names"
                refuse_files(self.path, (path.name for path in self.path.iterdir() if not _same(path, job)), hint)
            refuse_other_jobs(self.path, {v: claim for v, claim in self.claims.items() if v != self.verb}, data)

        self._on_root(look)

    def make(self, job: Path, resolved: str, claim: Claim) -> None:
        """Write the marker file and the job. Collective. Raises InputError if the directory cannot be written."""

        def act() -> None:
            self._rename_foreign_files(job)
            self.claims = {**self.claims, self.verb: claim}
            write_claims(self.path, self.claims)
            if self.outputs.checkpoints:
                self.checkpoints.mkdir(exist_ok=True)
            copy, resolved_copy = self.outputs.copies
            if not _same(self.path / copy, job):
                with files.replaced(self.path / copy) as new, job.open("rb") as given:
                    shutil.copyfileobj(given, new)
            files.replace_file(self.path / resolved_copy, resolved)

        self._on_root(act)

    def withdraw(self, job: Path) -> None:
        """Remove the files that `make` has written for the file of a job. The file of the job stays. Collective."""

        def act() -> None:
            del self.claims[self.verb]
            for name in self.outputs.copies:
                if not _same(self.path / name, job):
                    (self.path / name).unlink()
            if self.claims:
                write_claims(self.path, self.claims)
            else:
                (self.path / MARKER).unlink()

        self._on_root(act)

    def clear(self) -> None:
        """Remove files of earlier runs of this command. Collective.

        Call this after `make`, which renames foreign files: files with the names of results are removed here.
        """

        def act() -> None:
            checkpoints = (path for _, path in self.saved())
            for path in [*(self.path / name for name in self._names()), *self._unfinished(), *checkpoints]:
                path.unlink(missing_ok=True)

        self._on_root(act)

    def go_back(self, step: int) -> None:
        """Rename the checkpoints of steps later than `step`, and remove unfinished files. Collective."""

        def act() -> None:
            for path in self._unfinished():
                path.unlink()
            for later, path in self.saved():
                if later > step:
                    files.put_aside(path)

        self._on_root(act)

    def prune(self, keep: int) -> None:
        """Remove all checkpoints but the newest ones, whose number is `keep`. Root only."""
        with suppress(OSError):  # superfluous checkpoints do no harm
            for _, path in self.saved()[keep:]:
                path.unlink()

    def note(self, **facts: Any) -> None:
        """Set fields (`facts`) of this command's record (`Claim`) in the marker file. Root only. Errors of writing are
        ignored."""
        if (claim := self.claim) and (changed := replace(claim, **facts)) != claim:
            self.claims = {**self.claims, self.verb: changed}
            with suppress(OSError):
                write_claims(self.path, self.claims)

    def saved(self) -> list[tuple[int, Path]]:
        """Return steps and paths of the checkpoints that this command writes, the newest first. Root only."""
        return find_checkpoints(self.path) if self.outputs.checkpoints else []

    def results(self) -> list[str]:
        """Return the names of this verb's existing results. Root only."""
        found = [name for name in (self.outputs.table, self.outputs.maps) if name and (self.path / name).exists()]
        return [*found, *(path.name for _, path in self.saved())]

    def _names(self) -> list[str]:
        """Return the names of this verb's results, without those that another verb has in the directory."""
        others = {name for verb in self.claims if verb != self.verb for name in BY_VERB[verb].written}
        return [name for name in self.outputs.written if name not in others]

    def _unfinished(self) -> list[Path]:
        """Return the unfinished files of a killed run."""
        return [*self.path.glob("*.part"), *self.checkpoints.glob("*.part")]

    # -- ownership -----------------------------------------------------------------------------------------------------

    def _has_checkpoints(self) -> bool:
        """Return True if the directory has sound checkpoints, as a copy without its marker has."""
        return any(checkpoint.is_one(path) for _, path in find_checkpoints(self.path))

    def _rename_foreign_files(self, job: Path) -> None:
        """Rename files with the names of this verb's results if neither the marker nor a checkpoint proves their
        origin."""
        if self.claim is None and not (self.outputs.checkpoints and self._has_checkpoints()):
            for name in filter(None, (*self._names(), *self.outputs.copies, self.outputs.checkpoints)):
                if not _same(self.path / name, job):
                    files.put_aside(self.path / name)

    def _on_root(self, act: Callable[[], None]) -> None:
        """Call `act` on root. Collective. Raises InputError on all ranks if it fails."""
        hdf5.write_on_root(self.slab, act, f"the output directory {self.path} cannot be written", InputError)

    # -- the lock ------------------------------------------------------------------------------------------------------

    def _lock_and_read(self) -> None:
        self._made = [path for path in (self.path, *self.path.parents) if not path.exists()]
        files.refuse_pipes(self.path)
        self._take_lock()
        try:
            self.claims = read_claims(self.path)
        except ValueError as error:
            raise InputError(
                f"{error}, so the owner of {self.path} is unknown; give --out for another directory"
            ) from error

    def _take_lock(self) -> None:
        """Take the lock, which the system releases when this process ends. Raises InUseError."""
        deadline = time.monotonic() + MAX_SECONDS_TO_RELEASE
        path = self.path / LOCK
        while True:
            self.path.mkdir(parents=True, exist_ok=True)
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno not in NO_LOCKS:
                    holder = os.pread(handle, 200, 0).decode(errors="replace").strip() or "just started"
                    os.close(handle)
                    if time.monotonic() > deadline:
                        message = f"the output directory {self.path} is in use by another run ({holder})"
                        raise InUseError(message) from None
                    time.sleep(0.05)
                    continue
            if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
                break
            os.close(handle)  # the lock file was removed meanwhile
        self._lock = handle
        with suppress(OSError):  # information for users only
            os.ftruncate(handle, 0)
            os.pwrite(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)

    def _release(self) -> None:
        if self._lock is not None:
            with suppress(OSError):
                (self.path / LOCK).unlink()
            os.close(self._lock)
            self._lock = None
            with suppress(OSError):  # not empty: the run has written here
                for path in self._made:
                    path.rmdir()


def refuse_files(directory: Path, names: Iterable[str], hint: str = "") -> None:
    """Raise InputError if a directory without a marker is the directory of a sweep, or if it has foreign files.

    `names` are the names of its files. Hidden files and the files of `PERMITTED` are allowed.
    """
    foreign = sorted(name for name in names if not name.startswith(".") and name not in PERMITTED)
    if cases := len([*(directory / CASES).glob(f"*/{MARKER}")]):
        raise InputError(
            f"the output directory {directory} belongs to a sweep and has {cases} of its cases; give --out for another "
            "directory, or run the job of the sweep, one case of it with --case"
        )
    if foreign:
        shown = ", ".join(foreign[:SHOWN_NAMES]) + (
            f" and {len(foreign) - SHOWN_NAMES} more" * (len(foreign) > SHOWN_NAMES)
        )
        raise InputError(
            f"the output directory {directory} is not empty and was not made by this program: it has {shown}; "
            f"give --out for another directory{hint}"
        )


def refuse_other_jobs(directory: Path, claims: Mapping[str, Claim], data: Mapping[str, Any]) -> None:
    """Raise InputError if a directory has a record of another job. Two jobs are different if any section in `SCENE`
    differs. `data` is the present job as plain data."""
    for verb, claim in claims.items():
        if found := differences(claim.job, data, SCENE):
            raise InputError(
                f"the output directory {directory} has {BY_VERB[verb].words} of another job: {found}; "
                f"{keep_mesh(claim.job, found)}give --out for another directory"
            )


def _same(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:
        return False
