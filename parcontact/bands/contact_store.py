"""Contacts of the point that is being solved, also in a file, so that a killed run continues within this point.

All input of a contact has a digest. A line of the file is a digest and a rung, whose numbers are read back exactly,
so that repeated passes of `cascade` find the same states without a solve. An incomplete line is ignored. Marches of
`road_history` are stored in the same way.
"""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..errors import RunError
from ..job import Job
from ..job.sections import listing
from ..parallel.slab import Slab
from ..storage import hdf5
from .band import Rung

IGNORED = ("title", "steady", "output")  # sections on which no contact depends
NAME = "bands.part"  # removed with all unfinished files when a curve starts again


class ContactStore:
    """Solved contacts of a job, on root; methods are collective."""

    def __init__(self, slab: Slab) -> None:
        self._slab, self._job, self._path = slab, "", Path()
        self._known: dict[str, Rung] = {}

    def keep_in(self, directory: Path, job: Job, name: str = NAME) -> None:
        """Store contacts in a file of this directory, and read those in it. Raises RunError if it cannot be written."""
        self._path = directory / name
        self._on_root(lambda: self._read(job))

    def find(self, states: Sequence[Any], solve: Callable[[Sequence[int]], Sequence[Rung]]) -> list[Rung]:
        """Return contacts by their input in addition to the job, plain data; `solve` solves those that are not stored,
        given by their numbers. Raises RunError if the file cannot be written."""
        digests = [hashlib.sha256(repr((self._job, state)).encode()).hexdigest() for state in states]
        known = self._slab.agree([self._known.get(digest) for digest in digests])
        lacking = [number for number, rung in enumerate(known) if rung is None]
        solved = dict(zip(lacking, solve(lacking) if lacking else (), strict=True))
        found = {digests[number]: rung for number, rung in solved.items()}
        if self._slab.root:
            self._known |= found
        if self._path.name and found:
            self._on_root(lambda: self._append(found))
        return [rung or solved[number] for number, rung in enumerate(known)]

    def clear(self) -> None:
        """Forget all contacts, as their point has been written."""
        self._known = {}
        if self._path.name:
            self._on_root(lambda: self._path.unlink(missing_ok=True))

    def _read(self, job: Job) -> None:
        of_job = {name: part for name, part in listing.plain_job(job).items() if name not in IGNORED}
        self._job = repr((__version__, of_job))
        if not self._path.exists():
            return
        with self._path.open("r+b") as file:
            whole = 0
            for line in file:
                try:
                    digest, numbers = json.loads(line)
                    self._known[digest] = _rung(numbers)
                except (ValueError, TypeError, KeyError):
                    break
                whole += len(line)
            file.truncate(whole)

    def _append(self, found: dict[str, Rung]) -> None:
        lines = [json.dumps([digest, _plain(rung)]) for digest, rung in found.items()]
        with self._path.open("a") as file:
            file.write("".join(f"{line}\n" for line in lines))

    def _on_root(self, act: Callable[[], None]) -> None:
        hdf5.write_on_root(self._slab, act, f"cannot keep the contacts of a point in {self._path}", RunError)


def _plain(rung: Rung) -> dict[str, Any]:
    return {name: np.asarray(value).tolist() for name, value in asdict(rung).items()}


def _rung(numbers: dict[str, Any]) -> Rung:
    values = [numbers[each.name] for each in fields(Rung)]
    known: list[Any] = [np.array(value) if isinstance(value, list) else value for value in values]
    return Rung(*known)
