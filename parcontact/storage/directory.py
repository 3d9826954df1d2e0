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
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import InputError, InUseError, TakenError
from ..parallel.root import on_root
from ..parallel.slab import Slab
from . import checkpoint, curve_points, files, hdf5, marker, stopfile
from .marker import SCENE, SECTIONS, VERBS, Claim

MAX_SECONDS_TO_RELEASE = 3.0  # seconds: a run that was killed may need a moment to let go
RESULTS = {
    "run": ("measures.csv", "fields.h5", "fields.xdmf", "run.log"),
    "steady": ("steady.csv", "steady_waves.csv", "steady.h5", "steady_theory.csv", curve_points.LOG),
    "study": ("study.csv", "study.txt", "convergence.png", "work_precision.png"),
}
COPIES = {  # of the job: as given, and with every default
    "run": ("job.yaml", "job.resolved.yaml"),
    "steady": ("steady.job.yaml", "steady.resolved.yaml"),
    "study": ("study.job.yaml", "study.resolved.yaml"),
}
LOCK = ".lock"
BESIDE = (stopfile.NAME, "theory.csv", "theory.yaml")  # may be there before the first run
SHOWN = 4  # names of files that a message lists
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
ADVICE = "give --restart never to start afresh, or --out for another directory"


class Directory:
    """Where a verb writes. Only root touches it; methods whose docstring says "collective" tell all ranks."""

    def __init__(self, path: Path, slab: Slab, verb: str = "run") -> None:
        self.path, self.slab, self.verb = path, slab, verb
        self.claims: dict[str, Claim] = {}
        self._lock: int | None = None

    @property
    def checkpoints(self) -> Path:
        return self.path / "checkpoint"

    @property
    def stop_file(self) -> Path:
        return self.path / stopfile.NAME

    @property
    def claim(self) -> Claim | None:
        """What this verb has here; on root, None elsewhere."""
        return self.claims.get(self.verb)

    def checkpoint(self, step: int) -> Path:
        """The file for the checkpoint after a step."""
        return self.checkpoints / f"step-{step}.h5"

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """No other run writes here meanwhile; collective. A directory that does not exist is claimed when made."""
        try:
            self._on_root(self._lock_if_there)
            yield
        finally:
            self._release()

    def refuse_foreign(self, job: Path, data: Mapping[str, Any], afresh: bool) -> None:
        """Raise InputError where the files of others, or of another job, are; collective. `data`: the job, plain."""

        def look() -> str:
            foreign = self._foreign(job)
            if foreign and not self.claims and not afresh and not self._proven():
                names = ", ".join(foreign[:SHOWN]) + (f" and {len(foreign) - SHOWN} more" * (len(foreign) > SHOWN))
                return (
                    f"the output directory {self.path} is not empty and not of this program: it holds {names}; give "
                    "--out for another directory, or --restart never to write here and put files of these names aside"
                )
            for verb, claim in self.claims.items():
                if verb != self.verb and (found := "; ".join(marker.differences(claim.job, data, SCENE))):
                    return (
                        f"the output directory {self.path} holds {VERBS[verb]} of another job: {found}; give --out for "
                        "another directory"
                    )
            return ""

        self._on_root(look)

    def make(self, job: Path, resolved: str, claim: Claim) -> None:
        """Make the directory with the job in it; collective. Raises InputError where it cannot be written, TakenError
        where another run of the same job has been in it meanwhile."""

        def act() -> str:
            seen = self.claims
            if not self.path.is_dir() or self._lock is None:
                self.path.mkdir(parents=True, exist_ok=True)
                if problem := self._lock_if_there():
                    return problem
                if self.claims != seen or (self._foreign(job) and not self.claims):
                    taken = f"the output directory {self.path} has been taken by another run meanwhile"
                    if self.claims and self._are_of(claim):
                        raise TakenError(f"{taken}; run again to go on with it")
                    return f"{taken}; {ADVICE}"
            self._put_aside_what_is_not_ours(job)
            self.claims = {**self.claims, self.verb: claim}
            marker.write(self.path, self.claims)
            if self.verb == "run":
                self.checkpoints.mkdir(exist_ok=True)
            copy, table = COPIES[self.verb]
            if not _same(self.path / copy, job):
                with files.replaced(self.path / copy) as new, job.open("rb") as given:
                    shutil.copyfileobj(given, new)
            files.write(self.path / table, resolved)
            return ""

        self._on_root(act)

    def clear(self) -> None:
        """Remove what earlier runs of this verb wrote; collective. Only after `make`, which has put aside the rest."""

        def act() -> str:
            checkpoints = [path for _, path in self.saved()] if self.verb == "run" else []
            for path in [*(self.path / name for name in RESULTS[self.verb]), *self._unfinished(), *checkpoints]:
                path.unlink(missing_ok=True)
            return ""

        self._on_root(act)

    def go_back(self, step: int) -> None:
        """Put aside the checkpoints after a step, and remove unfinished files; collective."""

        def act() -> str:
            for path in self._unfinished():
                path.unlink()
            for later, path in self.saved():
                if later > step:
                    files.put_aside(path)
            return ""

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
                marker.write(self.path, self.claims)

    def saved(self) -> list[tuple[int, Path]]:
        """Checkpoints and their steps, the newest first; root only."""
        found = [
            (int(match.group(1)), path)
            for path in self.checkpoints.glob("step-*.h5")
            if (match := re.fullmatch(r"step-(\d+)\.h5", path.name))
        ]
        return sorted(found, reverse=True)

    def results(self) -> list[str]:
        """Names of this verb's results that are here; root only."""
        found = [name for name in RESULTS[self.verb][:2] if os.path.lexists(self.path / name)]
        return [*found, *(path.name for _, path in self.saved() if self.verb == "run")]

    def _unfinished(self) -> list[Path]:
        """Files that a run which was killed had not finished."""
        return [*self.path.glob("*.part"), *self.checkpoints.glob("*.part")]

    # -- whose it is --------------------------------------------------------------------------------------------------

    def _foreign(self, job: Path) -> list[str]:
        """What is here beside hidden files and the job that is to run."""
        if not self.path.is_dir():
            return []
        return sorted(
            path.name
            for path in self.path.iterdir()
            if not path.name.startswith(".") and path.name not in BESIDE and not _same(path, job)
        )

    def _are_of(self, claim: Claim) -> bool:
        """Whether all claims here are of the job of this one."""
        return not any(
            list(marker.differences(found.job, claim.job, SECTIONS if verb == self.verb else SCENE))
            for verb, found in self.claims.items()
        )

    def _proven(self) -> bool:
        """Whether a checkpoint says that the directory is ours, as in a copy that has lost its marker."""
        return any(checkpoint.is_one(path) for _, path in self.saved())

    def _put_aside_what_is_not_ours(self, job: Path) -> None:
        """Files that bear the names of this verb's, where neither the marker nor a checkpoint says that they are."""
        if self.claim is None and not (self.verb == "run" and self._proven()):
            for name in (*RESULTS[self.verb], *COPIES[self.verb], *(["checkpoint"] if self.verb == "run" else [])):
                if not _same(self.path / name, job):
                    files.put_aside(self.path / name)

    def _on_root(self, act: Callable[[], str]) -> None:
        """Root acts, and returns what stands in the way or ''; collective. Raises InputError on all ranks."""

        def attempt() -> None:
            try:
                problem = act()
            except hdf5.FAILURES as error:
                problem = f"the output directory {self.path} cannot be written: {hdf5.reason(error)}"
            if problem:
                raise InputError(problem)

        on_root(self.slab.comm, attempt)

    # -- the lock -----------------------------------------------------------------------------------------------------

    def _lock_if_there(self) -> str:
        """Take the lock and read the marker; returns what stands in the way."""
        if self._lock is None and self.path.is_dir():
            if problem := self._take_lock():
                return problem
            try:
                self.claims = marker.read(self.path)
            except ValueError as error:
                return f"{error}, so that it cannot be told whose {self.path} is; --out chooses another directory"
        return ""

    def _take_lock(self) -> str:
        """Take the lock, which the system gives back however this process ends. Returns what stands in the way; raises
        InUseError if it is another program."""
        deadline = time.monotonic() + MAX_SECONDS_TO_RELEASE
        path = self.path / LOCK
        while True:
            try:
                handle = files.opened(path, os.O_RDWR)
            except ValueError as error:
                return f"the output directory {self.path} cannot be locked by {path}: {error}"
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno not in NO_LOCKS:
                    holder = os.pread(handle, 200, 0).decode(errors="replace").strip()
                    os.close(handle)
                    if time.monotonic() > deadline:
                        who = holder or "just started"
                        raise InUseError(f"the output directory {self.path} is in use by another run ({who})") from None
                    time.sleep(0.05)
                    continue
            if files.is_the_file(path, handle):
                break
            os.close(handle)  # its last holder has removed it
        self._lock = handle
        with suppress(OSError):  # only for whom it may concern
            os.ftruncate(handle, 0)
            os.pwrite(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)
        return ""

    def _release(self) -> None:
        if self._lock is not None:
            with suppress(OSError):
                (self.path / LOCK).unlink()
            os.close(self._lock)
            self._lock = None


def _same(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:
        return False
