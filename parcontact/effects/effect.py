"""Interfaces that an effect implements.

Interface of effects: a decision from the job alone, and what is made, remembered and written if the effect is on.

An effect is one class, found by the section that it adds to a job (`job.listing`); no other file refers to
it. It may provide the contact law, and it is called after each step.

The contact law of a job: admissible pressures, and where surfaces touch in saved maps.

Interface of contact laws: how a step is solved, its memory, and where surfaces touch.

`ContactLaw` is the interface that a march uses. By itself it is a constraint on pressures
(`march.laws`). Effects may provide other laws, in which, say, the gap is the unknown.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from functools import wraps
from inspect import getattr_static, isfunction
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, NamedTuple, Protocol, TypeVar

from numpy.typing import DTypeLike, NDArray

from ..contact.constraint import Box, Mask
from ..doubts import Doubt
from ..errors import InputError
from ..job import Job, listing
from ..job.history import Step
from ..job.listing import effects_of
from ..job.parts import Part
from ..parallel.slab import Array
from ..physics.entries import Entry, Memory, Saved, Units
from ..physics.measures import Measures
from ..physics.motion import Shear, Vector

if TYPE_CHECKING:
    from ..contact.problem import Contact, Control
    from ..physics.body import Trial
    from ..physics.energy import EnergyMemory

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

    `numbers`: further results of the law, by name. `pull`: force of all tension [N]. `least_load`: load [N] up to
    which a load is an error of the solver. `snapped`: the contact passed through states without equilibrium. `remark`:
    a sentence for run.log, or ''. `end` is one of

    * "equilibrium";
    * "detached": no equilibrium was left;
    * "opened": the run continues with the surfaces far from each other;
    * "open": in the steps after that.
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
    """A contact law, a part of the run. Methods are collective.

    A law that builds on the usual contact, the bounds of pressure alone, may have a method `upon`. It takes the usual
    law and returns the whole one."""

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


EXTRAPOLATION, TOLERANCES = "extrapolated starts", "looser tolerances"  # see `Effect.forbids`
SINGLE, BY_THEORY = "single precision", "Persson's theory"


@dataclass(frozen=True)
class Decision:
    """Decision about an effect: whether it is on, and the reason in a few words."""

    name: str
    on: bool
    why: str


@dataclass(frozen=True)
class Sheared:
    """Effect of tractions along the surface in a step: the measures including them, their force [N] on the rigid
    surface, and the energy lost in slip [J]. With heat the map `slipping` is in proportion to the power of slip;
    at rest, or if nothing slips, to the bounds of tractions. `error` is the relative error of their solve, a `share` of
    them has the error of the area, and `time` and `mesh` are their relative errors by the length of the step and by the
    stiffness of spots on the mesh."""

    measures: Measures
    force: Vector
    lost: float
    slipping: Array
    error: float = 0.0
    share: float = 0.0
    time: float = 0.0
    mesh: float = 0.0


@dataclass(frozen=True)
class Instant:
    """A step just made, in the run's units unless stated; maps are valid until the next step begins.

    The pressure on this rank's rows is `modulus pressure`, `displacement` is the displacement of the body, and
    `touching` is not 0 where the surfaces touch; their shape is (ny_loc, nx). `before` and `measures` belong to the
    step before and to this one. In this step the surface moved by `moved` [m], and the stored plus dissipated energy
    of the body changed by `gained` [J], NaN without energies. Edges of a contact that attracts moved by `front` half
    process zones; `untouched` if nothing touched or was under tension before and after the step. `error_friction` is
    the estimated relative error of friction, infinite without friction.
    """

    step: Step
    solved: SolvedContact[Any]
    modulus: float
    displacement: Array
    before: Measures
    measures: Measures
    moved: tuple[float, float]
    gained: float
    dissipated: float
    front: float
    untouched: bool
    error_friction: float = math.inf
    error_area: float = 0.0
    sheared: Sheared | None = None

    @property
    def pressure(self) -> Array:
        return self.solved.contact.p

    @property
    def touching(self) -> NDArray[Any]:
        return self.solved.touching

    @property
    def slid(self) -> float:
        """Distance by which the surface moved [m]."""
        return math.hypot(*self.moved)


@dataclass(frozen=True)
class Changes(Generic[Remembered]):
    """Changes by an effect in a step: its memory, a sentence for run.log or '', and whether errors can be stated across
    the step. `turned` is the change of the mean traction over the mean bound of traction."""

    memory: Remembered
    remark: str = ""
    states_errors: bool = True
    sheared: Sheared | None = None
    turned: float = 0.0


class Effect(Protocol[Memory]):
    """Class of an effect; made with a `Scene` only if the job asks for it, and a part of the run.

    It may have `rules` for the whole job, as sections have them; `lifts`, checks of jobs that do not apply with it; a
    `stage`, the class of the stages of a history with keys that it adds; and functions of a job `doubts` and `facts`,
    which give warnings (`doubts.Doubt`, or sentences) and sentences about the section. `describe_waves` of a job gives
    sentences on the waves of its surface on one grid, from bins of wavenumbers [rad/m] and their mean square slopes.
    `changed_material` of a job is in place of its material; `why_no_curve` and `why_no_theory` return why it has no
    friction curve, and no prediction by Persson's theory, `why_not_folded` why all branches of the body need maps.
    `curve_options` yields what its columns of friction curves require (`Column.when`). Methods are collective unless
    stated. The base class has no memory.
    """

    section: ClassVar[type[Part]]  # section that it adds to a job
    columns: ClassVar[tuple[str, ...]]  # columns that it adds to measures.csv
    fields: ClassVar[tuple[str, ...]] = ()  # maps that effects of this package add to those of output.fields
    in_bands_over_time: ClassVar[bool] = False  # True for classes that jobs in bands with a history may have
    in_curves: ClassVar[bool] = False  # True for classes that act in friction curves
    brings_law: ClassVar[bool] = False  # True for classes with a `law`; they exclude steady sliding
    forbids: ClassVar[Mapping[str, str]] = {}  # what is not done with it (EXTRAPOLATION, SINGLE, ...), with reasons

    def __init_subclass__(cls, **others: Any) -> None:
        super().__init_subclass__(**others)
        if "brings_law" not in vars(cls):
            cls.brings_law = cls.brings_law or "law" in vars(cls)

    @staticmethod
    def decide(job: Any) -> Decision:
        """Return whether the job asks for it, with its name in checkpoints; the same on every rank."""
        ...

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        """Return the types of the maps that it has in checkpoints and in memory, for `parcontact plan`. For effects of
        this package the plan counts allocations instead."""
        return ()

    @staticmethod
    def shear(job: Any) -> Shear | None:
        """Return the friction of the contact area that it adds, in marches and in steady sliding, or None. Forces of
        all effects are added."""
        return None

    @staticmethod
    def touches(job: Any, pressure: Array, gap: Array) -> NDArray[Any] | None:
        """Return a map that is not 0 where surfaces touch, from saved maps of the pressure [Pa] and of the gap [m]. It
        is None without a law. Local."""
        return None

    @staticmethod
    def remembers(job: Any) -> bool:
        """Return True if the contact depends on its history, also that of an elastic body."""
        return False

    @staticmethod
    def sheared_first(job: Any) -> bool:
        """Return True if it shears the contact before it slides, within far less than a wave."""
        return False

    @staticmethod
    def compares_heights(job: Any) -> bool:
        """Return True if warnings compare the heights of the surface with a length of the section."""
        return False

    @staticmethod
    def chosen_values(job: Any) -> Mapping[str, float]:
        """Return the lengths [m] that it chooses by the mesh, by their keys."""
        return {}

    @staticmethod
    def doubt_heights(job: Any, span: float) -> Iterator[Doubt]:
        """Yield warnings about a rough surface by its height from the lowest to the highest point [m]."""
        yield from ()

    @staticmethod
    def doubt_contact(job: Any, measures: Measures, where: str) -> Iterator[Doubt]:
        """Yield warnings about the contact of a step, at a place in words."""
        yield from ()

    @staticmethod
    def doubt_cases(jobs: Sequence[Any]) -> Iterator[Doubt]:
        """Yield warnings about the differences between the jobs of a sweep."""
        yield from ()

    @staticmethod
    def ended(job: Any, saved: Saved) -> Detached | None:
        """Return the end of the run in the entries of its law in a checkpoint; None if the run goes on."""
        return None

    def __init__(self, scene: Any) -> None: ...

    def last_lines(self, memory: Memory) -> Iterator[str]:
        """Yield sentences for the end of a run; local."""
        yield from ()

    def law(self) -> ContactLaw[Any] | None:
        """Return the contact law of the steps; None if the effect has none."""
        return None

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""
        return None  # type: ignore[return-value]

    def follow(self, instant: Instant, memory: Memory) -> Changes[Memory]:
        """Return the changes of a step that was made."""
        ...

    def values(self, memory: Memory) -> Sequence[float]:
        """Return the values of its columns for the last step, the same on every rank; NaN leaves a column empty. Local
        to this rank."""
        ...

    def field(self, memory: Memory, name: str) -> Array:
        """Return this rank's rows of one of its maps in SI units, a new array."""
        ...

    def time_factor(self, memory: Memory) -> float:
        """Return the relaxation times after a step over those at the job's temperature. Raises RunError."""
        return 1.0

    def work(self, memory: Memory) -> float | None:
        """Return the work of the load since the start [J]; None if it is that on the body."""
        return None

    def error_energy(self, memory: Memory) -> float | None:
        """Return the error of the energies since the start [J]; None if it is that of a body under pressure."""
        return None

    def further_energies(self, memory: Memory) -> tuple[EnergyMemory, float] | None:
        """Return energies of the body, in the unit of the scene, to be added to those under pressure, and further
        losses of work [J]; None without such energies."""
        return None

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the entries of a memory in checkpoints, by name; maps belong to it, or are made for a checkpoint."""
        return {}

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory of a checkpoint, in the run's units, numbers as arrays. Maps have been read into the maps
        of `entries`."""
        return memory


Effects = Mapping[str, Effect[Any]]
Memories = Mapping[str, Any]


class _NamedLaw:
    """Contact law of an effect of another package; errors of its methods name the effect."""

    def __init__(self, law: Any, section: str) -> None:
        self._law, self._section = law, section

    def __getattr__(self, name: str) -> Any:
        member = getattr(self._law, name)
        if not callable(member):
            return member

        @wraps(member)
        def call(*given: Any, **named: Any) -> Any:
            with listing.naming_effect(self._section):
                return member(*given, **named)

        return call


def guarded(section: str, effect: type[Effect[Any]]) -> type[Effect[Any]]:
    """Return the class of an effect. Errors in an effect of another package name it, and maps of an instant are
    read-only for it."""
    if listing.is_ours(section):
        return effect

    def guard(name: str, method: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(method)
        def call(*given: Any) -> Any:
            instants = [one for one in given if isinstance(one, Instant)]
            with listing.naming_effect(section), ExitStack() as kept:
                for one in instants:
                    for field in (one.pressure, one.displacement, one.touching):
                        kept.callback(setattr, field.flags, "writeable", field.flags.writeable)
                        field.flags.writeable = False
                found = method(*given)
            return _NamedLaw(found, section) if name == "law" and found is not None else found

        return call

    members: dict[str, Any] = {"brings_law": getattr(effect, "brings_law", False)}
    for name in (*(name for name in dir(effect) if not name.startswith("_")), "__init__"):
        raw = getattr_static(effect, name)
        if isinstance(raw, staticmethod):
            members[name] = staticmethod(guard(name, raw.__func__))
        elif isfunction(raw):
            members[name] = guard(name, raw)
    return type(effect.__name__, (effect,), members)


def columns_of(effects: Effects) -> tuple[str, ...]:
    """Return the columns that effects add to measures.csv."""
    return tuple(name for effect in effects.values() for name in effect.columns)


def effect_values(effects: Effects, memories: Memories) -> tuple[float, ...]:
    """Return the values of all columns of effects for the last step; raises InputError for values that do not fit."""
    return tuple(number for name, effect in effects.items() for number in _numbers(name, effect, memories[name]))


def _numbers(name: str, effect: Effect[Any], memory: Any) -> list[float]:
    values, found = effect.values(memory), list[float]()
    with suppress(TypeError, ValueError):
        found = [float(value) for value in values]
    if len(found) != len(effect.columns):
        wanted = f"must give a number for each of its columns ({', '.join(effect.columns)})"
        raise InputError(f"the effect {name} cannot be used: its values() {wanted}, got {values!r:.80}")
    return found


def constraint_of(job: Job, unit: float = 1.0, most: float = math.inf) -> Box:
    """Return the constraint of a job without a law of its own, for a `unit` of pressure [Pa]; pressures are at
    most `most` units."""
    hardness = job.material.hardness
    return Box() if hardness is None or hardness / unit >= most else Box(highest=hardness / unit)


def touching_of(job: Job, pressure: Array, gap: Array) -> Mask:
    """Return a map that is not 0 where surfaces touch, from saved maps of the pressure [Pa] and of the gap [m]."""
    for effect in effects_of(type(job).model_fields).values():
        touching = effect.touches(job, pressure, gap) if effect.decide(job).on and hasattr(effect, "touches") else None
        if touching is not None:
            return touching
    return constraint_of(job).touches(pressure)
