"""The output directory of a run: one run at a time, its marker, its job files, its checkpoints.

The lock is taken first, then it is seen whose the directory is, and only then something is written.
"""

import errno
import fcntl
import os
import re
import shutil
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import InputError, InUseError
from ..job.reading import CASES
from ..parallel.slab import Slab
from . import checkpoint, curve_points, files, hdf5, marker, stopfile
from .marker import SCENE, VERBS, Claim

MAX_SECONDS_TO_RELEASE = 3.0  # tuning: seconds: a run that was killed may need a moment to let go
RESULTS = {
    "run": ("measures.csv", "fields.h5", "fields.xdmf", "run.log"),
    "steady": (
        "steady.csv",
        "steady_waves.csv",
        "bands.csv",
        "steady.h5",
        "steady_theory.csv",
        "bands_theory.csv",
        curve_points.LOG,
    ),
    "study": ("study.csv", "study.txt", "convergence.png"),
}
COPIES = {  # of the job: as given, and with every default
    "run": ("job.yaml", "job.resolved.yaml"),
    "steady": ("steady.job.yaml", "steady.resolved.yaml"),
    "study": ("study.job.yaml", "study.resolved.yaml"),
}
LOCK = ".lock"
BESIDE = (
    stopfile.NAME,
    "theory.csv",
    "theory.yaml",
    "steady_theory.csv",
    "bands_theory.csv",
)  # may be there before the first run
SHOWN = 4  # tuning: names of files that a message lists
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
ADVICE = "give --restart never to start afresh, or --out for another directory"


class Directory:
    """A directory of results. Only root touches it; methods whose docstring says "collective" tell all ranks."""

    def __init__(self, path: Path, slab: Slab, verb: str = "run") -> None:
        self.path, self.slab, self.verb = path, slab, verb
        self.claims: dict[str, Claim] = {}
        self._lock: int | None = None
        self._made: list[Path] = []

    @property
    def checkpoints(self) -> Path:
        return self.path / "checkpoint"

    @property
    def stop_file(self) -> Path:
        return self.path / stopfile.NAME

    @property
    def claim(self) -> Claim | None:
        """The claim of this verb, on root; None elsewhere."""
        return self.claims.get(self.verb)

    def checkpoint(self, step: int) -> Path:
        """Return the path of the checkpoint after a step."""
        return self.checkpoints / f"step-{step}.h5"

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Keep other runs from writing here meanwhile; collective. A new directory that stays empty is removed."""
        try:
            self._on_root(self._lock_and_read)
            yield
        finally:
            self._release()

    def refuse_foreign(self, job: Path, data: Mapping[str, Any], afresh: bool) -> None:
        """Raise InputError where the files of others, or of another job, are; collective. `data`: the job, plain."""

        def look() -> None:
            if not self.claims and not afresh and not self._has_checkpoints():
                hint = ", or --restart never to write here and put files of these names aside"
                refuse_files(self.path, (path.name for path in self.path.iterdir() if not _same(path, job)), hint)
            refuse_other_jobs(self.path, {v: claim for v, claim in self.claims.items() if v != self.verb}, data)

        self._on_root(look)

    def make(self, job: Path, resolved: str, claim: Claim) -> None:
        """Put the marker and the job into the directory; collective. Raises InputError where it cannot be written."""

        def act() -> None:
            self._put_aside_what_is_not_ours(job)
            self.claims = {**self.claims, self.verb: claim}
            marker.write_claims(self.path, self.claims)
            if self.verb == "run":
                self.checkpoints.mkdir(exist_ok=True)
            copy, table = COPIES[self.verb]
            if not _same(self.path / copy, job):
                with files.replaced(self.path / copy) as new, job.open("rb") as given:
                    shutil.copyfileobj(given, new)
            files.replace_file(self.path / table, resolved)

        self._on_root(act)

    def clear(self) -> None:
        """Remove what earlier runs of this verb wrote; collective. Only after `make`, which has put aside the rest."""

        def act() -> None:
            checkpoints = [path for _, path in self.saved()] if self.verb == "run" else []
            for path in [*(self.path / name for name in RESULTS[self.verb]), *self._unfinished(), *checkpoints]:
                path.unlink(missing_ok=True)

        self._on_root(act)

    def go_back(self, step: int) -> None:
        """Put aside the checkpoints after a step, and remove unfinished files; collective."""

        def act() -> None:
            for path in self._unfinished():
                path.unlink()
            for later, path in self.saved():
                if later > step:
                    files.put_aside(path)

        self._on_root(act)

    def prune(self, keep: int) -> None:
        """Remove all but the newest checkpoints; root only."""
        with suppress(OSError):  # too many are no harm
            for _, path in self.saved()[keep:]:
                path.unlink()

    def note(self, **facts: Any) -> None:
        """Change what the marker says of this verb; root only. That it cannot be written ends no run."""
        if (claim := self.claim) and (changed := replace(claim, **facts)) != claim:
            self.claims = {**self.claims, self.verb: changed}
            with suppress(OSError):
                marker.write_claims(self.path, self.claims)

    def saved(self) -> list[tuple[int, Path]]:
        """Return checkpoints and their steps, the newest first; root only."""
        found = [
            (int(match.group(1)), path)
            for path in self.checkpoints.glob("step-*.h5")
            if (match := re.fullmatch(r"step-(\d+)\.h5", path.name))
        ]
        return sorted(found, reverse=True)

    def results(self) -> list[str]:
        """Return the names of this verb's results that are here; root only."""
        found = [name for name in RESULTS[self.verb][:2] if (self.path / name).exists()]
        return [*found, *(path.name for _, path in self.saved() if self.verb == "run")]

    def _unfinished(self) -> list[Path]:
        """Return the files that a run which was killed had not finished."""
        return [*self.path.glob("*.part"), *self.checkpoints.glob("*.part")]

    # -- whose it is --------------------------------------------------------------------------------------------------

    def _has_checkpoints(self) -> bool:
        """Return whether the directory proves to be ours, as a copy that has lost its marker does."""
        return any(checkpoint.is_one(path) for _, path in self.saved())

    def _put_aside_what_is_not_ours(self, job: Path) -> None:
        """Put aside files of the names of this verb's where neither the marker nor a checkpoint says that they are."""
        if self.claim is None and not (self.verb == "run" and self._has_checkpoints()):
            for name in (*RESULTS[self.verb], *COPIES[self.verb], *(["checkpoint"] if self.verb == "run" else [])):
                if not _same(self.path / name, job):
                    files.put_aside(self.path / name)

    def _on_root(self, act: Callable[[], None]) -> None:
        """Act on root; collective. Raises InputError on all ranks if that fails."""
        hdf5.write_on_root(self.slab, act, f"the output directory {self.path} cannot be written", InputError)

    # -- the lock -----------------------------------------------------------------------------------------------------

    def _lock_and_read(self) -> None:
        self._made = [path for path in (self.path, *self.path.parents) if not path.exists()]
        self._take_lock()
        try:
            self.claims = marker.read_claims(self.path)
        except ValueError as error:
            raise InputError(
                f"{error}, so that the owner of {self.path} is unknown; --out chooses another directory"
            ) from error

    def _take_lock(self) -> None:
        """Take the lock, which the system gives back however this process ends; raises InUseError."""
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
            os.close(handle)  # its last holder has removed it
        self._lock = handle
        with suppress(OSError):  # only for whom it may concern
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
    """Raise InputError if a directory that is not ours holds files of these names, beside hidden ones and `BESIDE`, or
    is that of a sweep."""
    foreign = sorted(name for name in names if not name.startswith(".") and name not in BESIDE)
    if cases := len([*(directory / CASES).glob(f"*/{marker.MARKER}")]):
        raise InputError(
            f"the output directory {directory} is that of a sweep, with {cases} of its cases; give --out for another "
            "directory, or run the job of the sweep, one case of it with --case"
        )
    if foreign:
        shown = ", ".join(foreign[:SHOWN]) + (f" and {len(foreign) - SHOWN} more" * (len(foreign) > SHOWN))
        raise InputError(
            f"the output directory {directory} is not empty and not of this program: it holds {shown}; give --out for "
            f"another directory{hint}"
        )


def refuse_other_jobs(directory: Path, claims: Mapping[str, Claim], data: Mapping[str, Any]) -> None:
    """Raise InputError if one of the claims of a directory is of another scene than the job `data`, as plain data."""
    for verb, claim in claims.items():
        if found := marker.list_differences(marker.differences(claim.job, data, SCENE)):
            raise InputError(
                f"the output directory {directory} holds {VERBS[verb]} of another job: {found}; "
                f"{marker.keep_mesh(claim.job, found)}give --out for another directory"
            )


def _same(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:
        return False
