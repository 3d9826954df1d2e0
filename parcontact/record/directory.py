"""The output directory of a run: one run at a time, its job files, its checkpoints."""

import errno
import fcntl
import os
import re
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import InputError
from ..parallel.slab import Slab
from . import hdf5

PATIENCE = 3.0  # seconds: a run that was killed may need a moment to let go
OUTPUTS = ("measures.csv", "fields.h5", "fields.xdmf", "run.log")
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


class Directory:
    """Where a run writes. Only root touches it; methods whose docstring says "collective" tell all ranks."""

    def __init__(self, path: Path, slab: Slab) -> None:
        self.path, self.slab = path, slab
        self._lock: int | None = None

    @property
    def checkpoints(self) -> Path:
        return self.path / "checkpoint"

    @property
    def stop_file(self) -> Path:
        return self.path / "stop"

    def checkpoint(self, step: int) -> Path:
        """The file for the checkpoint after a step."""
        return self.checkpoints / f"step-{step}.h5"

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """No other run writes here meanwhile; collective. A directory that does not exist is claimed when made."""
        try:
            self._claim_if_there()
            yield
        finally:
            self._release()

    def make(self, job: Path, resolved: str) -> None:
        """Make the directory with the job in it; collective. Raises InputError where it cannot be written."""

        def act() -> None:
            self.checkpoints.mkdir(parents=True, exist_ok=True)
            copy = self.path / "job.yaml"
            if not (copy.exists() and copy.samefile(job)):
                with hdf5.replaced(copy) as part:
                    shutil.copyfile(job, part)
            with hdf5.replaced(self.path / "job.resolved.yaml") as part:
                part.write_text(resolved)

        hdf5.on_root(self.slab, act, f"the output directory {self.path} cannot be written", InputError)
        self._claim_if_there()

    def clear(self) -> None:
        """Remove what earlier runs wrote; collective."""

        def act() -> None:
            for path in (*(self.path / name for name in OUTPUTS), *self.checkpoints.glob("step-*.h5*")):
                path.unlink(missing_ok=True)

        hdf5.on_root(self.slab, act, f"the output directory {self.path} cannot be written", InputError)

    def go_back(self, step: int) -> None:
        """Put aside the checkpoints after a step, and remove unfinished files; collective."""

        def act() -> None:
            for path in self.checkpoints.glob("*.part"):
                path.unlink()
            for later, path in self.saved():
                if later > step:
                    path.rename(path.with_name(path.name + ".aside"))

        hdf5.on_root(self.slab, act, f"the output directory {self.path} cannot be written", InputError)

    def prune(self, keep: int) -> None:
        """Remove all but the newest checkpoints; root only."""
        with suppress(OSError):  # too many are no harm
            for _, path in self.saved()[keep:]:
                path.unlink()

    def saved(self) -> list[tuple[int, Path]]:
        """Checkpoints and their steps, the newest first; root only."""
        found = [
            (int(match.group(1)), path)
            for path in self.checkpoints.glob("step-*.h5")
            if (match := re.fullmatch(r"step-(\d+)\.h5", path.name))
        ]
        return sorted(found, reverse=True)

    # -- the lock -----------------------------------------------------------------------------------------------------

    def _claim_if_there(self) -> None:
        problem = ""
        if self.slab.root and self._lock is None and self.path.is_dir():
            try:
                problem = self._claim()
            except OSError as error:
                problem = f"the output directory {self.path} cannot be written: {hdf5.reason(error)}"
        if problem := self.slab.agree(problem):
            raise InputError(problem)

    def _claim(self) -> str:
        """Take the lock, which the system gives back however this process ends. Returns what stands in the way."""
        deadline = time.monotonic() + PATIENCE
        path = self.path / ".lock"
        while True:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno not in NO_LOCKS:
                    holder = os.pread(handle, 200, 0).decode(errors="replace").strip()
                    os.close(handle)
                    if time.monotonic() > deadline:
                        return f"the output directory {self.path} is in use by another run ({holder or 'just started'})"
                    time.sleep(0.05)
                    continue
            if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
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
                (self.path / ".lock").unlink()
            os.close(self._lock)
            self._lock = None
