"""The law of a contact: how a step of it is solved, what it remembers, and where surfaces touch.

`ContactLaw` is all that a march asks. The law of a job without adhesion is that of a constraint on pressures
(`march.dry_law`); with adhesion the gap is the unknown (`effects.adhesive_law`). An effect brings another law.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, Literal, NamedTuple, Protocol, TypeVar

from ..history.timeline import Step
from ..parallel.slab import Array
from ..physics.entries import Entry, Memory, Saved
from ..physics.measures import Measures
from ..physics.units import Units

if TYPE_CHECKING:  # what solves is not loaded to check a job
    from ..physics.body import Trial
    from ..solve.constraint import Mask
    from ..solve.contact import Contact
    from ..solve.problem import Control

Remembered = TypeVar("Remembered", covariant=True)
End = Literal["equilibrium", "detached", "opened", "open"]


class PreviousPressure(NamedTuple):
    """The pressure after a step: a map of p with the pressure `alpha p`, and where the surface was [m]; with an alpha
    of 0 none is known."""

    pressure: Array
    alpha: float = 0.0
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class PreviousContacts:
    """Memory of the contacts of earlier steps: the last pressures, the newest first, and the last approach d.

    A history of single solves keeps one pressure, others two or more. The next one will be in the map `spare`.
    """

    pressures: tuple[PreviousPressure, ...]
    spare: Array
    approach: float

    @property
    def last(self) -> PreviousPressure:
        return self.pressures[0]


@dataclass(frozen=True)
class SolvedContact(Generic[Remembered]):
    """The contact of a step: what the law remembers after it, and a map that is not 0 where the surfaces touch.

    `numbers` are those of the law, by name; all tension adds up to the force `pull` [N]. Loads up to `least_load` [N]
    are the solver's error, any load where neither pressure nor tension is more than that. The contact is in
    `equilibrium`; or it is `detached`, as nothing holds the load; or it was `opened` for that reason, where the run
    goes on with the surfaces far apart, and then stays `open`. `snapped` says that it passed over states without
    equilibrium. `remark` is a sentence for run.log, or ''.
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
        """Return whether there is pressure or tension."""
        return self.least_load < math.inf


class EdgeMotion(NamedTuple):
    """Motion of a contact in a step: half process zones by which its edges moved; whether nothing touches before and
    after the step, nor is under tension; and whether an adhesive contact begins or ends."""

    front: float = 0.0
    untouched: bool = False
    begins: bool = False


class Detached(NamedTuple):
    """When nothing held the surfaces any more [s], and under which load."""

    time: float
    load: float


class ContactLaw(Protocol[Memory]):
    """A law of contact, which is a part of the run. Methods are collective."""

    may_shorten: bool  # whether a step that fails is made shorter, where it may be

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
        """Solve a step of the body from the memory, contacts and measures of the step before, with the pressure in the
        spare map, to a tolerance, None for that of the job. A contact that was not solved has a `failure`."""

    def motion(self, solved: SolvedContact[Memory], before: Measures, now: Measures) -> EdgeMotion:
        """Return how the contact has moved in a step, from its measures before and after it."""

    def gap(self, memory: Memory) -> Array | None:
        """Return the map of the gap if that is what is solved for, else None."""

    def detached(self, memory: Memory) -> Detached | None:
        """Return when nothing held the surfaces any more; None where they are held."""

    def with_end(self, memory: Memory, end: Detached) -> Memory:
        """Return the memory of a run in which nothing holds the surfaces any more."""

    # -- as a part of the run ------------------------------------------------------------------------------------------

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return what a checkpoint has of a memory."""

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory of a checkpoint."""
