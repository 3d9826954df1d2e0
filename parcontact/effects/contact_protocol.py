"""Interface of contact laws: how a step is solved, its memory, and where surfaces touch.

`ContactLaw` is the interface that a march uses. By itself it is a constraint on pressures
(`march.dry_law`). Effects may provide other laws, in which, say, the gap is the unknown.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, Protocol, TypeVar

from ..history.timeline import Step
from ..parallel.slab import Array
from ..physics.entries import Entry, Memory, Saved
from ..physics.measures import Measures
from ..physics.units import Units

if TYPE_CHECKING:  # solvers are not imported to check a job
    from ..physics.body import Trial
    from ..solve.constraint import Mask
    from ..solve.contact import Contact
    from ..solve.problem import Control

Remembered = TypeVar("Remembered", covariant=True)
End = Literal["equilibrium", "detached", "opened", "open"]


class PreviousPressure(NamedTuple):
    """The pressure after a step, a map of p with the pressure `alpha p`, and the position of the surface [m]; unknown
    if alpha is 0."""

    pressure: Array
    alpha: float = 0.0
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class PreviousContacts:
    """Memory of earlier contacts: the last pressures, the newest first, and the last approach d.

    A history of single solves stores one pressure, others two or more. The next pressure is written to the map `spare`.
    """

    pressures: tuple[PreviousPressure, ...]
    spare: Array
    approach: float

    @property
    def last(self) -> PreviousPressure:
        return self.pressures[0]


@dataclass(frozen=True)
class SolvedContact(Generic[Remembered]):
    """The contact of a step, the memory of the law after it, and a map that is not 0 where the surfaces touch.

    `numbers` are further results of the law, by name; `pull` is the force of all tension [N]. Loads up to
    `least_load` [N] are errors of the solver. `end`: the contact is in `equilibrium`; or `detached`; or it was
    `opened` after detachment, as the run continues with the surfaces far from each other, and then stays `open`.
    `snapped`: it passed through states without equilibrium. `remark` is a sentence for run.log, or ''.
    """

    contact: Contact
    memory: Remembered
    touching: Mask
    numbers: Mapping[str, float] = field(default_factory=dict)
    pull: float = 0.0
    least_load: float = 0.0
    end: End = "equilibrium"
    snapped: bool = False
    remark: str = ""

    @property
    def loaded(self) -> bool:
        """True if there is pressure or tension."""
        return self.least_load < math.inf


class EdgeMotion(NamedTuple):
    """Motion of a contact in a step: of its edges [half process zones]; `untouched` if nothing touches or is under
    tension before and after the step; `begins` if a contact that attracts begins or ends."""

    front: float = 0.0
    untouched: bool = False
    begins: bool = False


class Detached(NamedTuple):
    """Time [s] and load at which the surfaces detached."""

    time: float
    load: float


NEVER = -1.0  # a time [s] in a checkpoint


def entries_of_end(end: Detached | None, job: Any) -> dict[str, Entry]:
    """Return the entries of a detachment, None before one, in checkpoints of a job."""
    time, load = end or (NEVER, 0.0)
    return {"detached at": Entry(time, 1.0, "s"), "detached under": Entry(load), "history": Entry(_mark(job))}


def end_in(job: Any, saved: Saved) -> Detached | None:
    """Return time and load of the detachment from the entries of a law in a checkpoint; None before a detachment, or if
    the job has another history."""
    if "detached at" not in saved or saved["detached at"] == NEVER or float(saved["history"]) != _mark(job):
        return None
    return Detached(float(saved["detached at"]), float(saved["detached under"]))


def _mark(job: Any) -> float:
    """Return a checksum of the history of a job."""
    return float(zlib.crc32(repr(job.history).encode()))


UNITS_OF_LOADS = {"pressure": " Pa", "force": " N", "approach": " m"}


def nothing_holds(control: str, load: float) -> str:
    """Return the sentence on surfaces that detach under a prescribed load."""
    return f"the surfaces detach under a {control} of {load:g}{UNITS_OF_LOADS[control]}"


class ContactLaw(Protocol[Memory]):
    """A contact law, a part of the run. Methods are collective. A law that solves by that of the constraint may have a
    method `upon`, which gets the latter and returns the law."""

    may_shorten: bool  # True if a failed chosen step is repeated with a shorter one

    def solve(
        self,
        trial: Trial,
        step: Step,
        control: Control,
        memory: Memory,
        past: PreviousContacts,
        before: Measures,
        tolerance: float | None,
    ) -> SolvedContact[Memory]:
        """Solve a step of the body, with the memory, contacts and measures of the step before, and put the pressure
        into the spare map. A `tolerance` of None means the tolerance of the job. A contact that was not solved has a
        `failure`."""

    def motion(self, solved: SolvedContact[Memory], before: Measures, now: Measures) -> EdgeMotion:
        """Return the motion of the contact in a step from its measures before and after it."""

    def gap(self, memory: Memory) -> Array | None:
        """Return the map of the gap if it is the unknown, else None."""

    def detached(self, memory: Memory) -> Detached | None:
        """Return time and load of the detachment; None before."""

    def with_end(self, memory: Memory, end: Detached) -> Memory:
        """Return the memory of a run whose surfaces have detached."""

    # -- as a part of the run ------------------------------------------------------------------------------------------

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the entries of a memory in checkpoints."""

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory of a checkpoint."""
