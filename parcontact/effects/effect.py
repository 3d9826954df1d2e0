"""Interfaces that an effect and a contact law implement.

An effect is one class, found by the section that it adds to a job (`job.listing`); no other file refers to it. It makes
a decision from the job alone, and states what is made, remembered and written if it is on. An effect may provide the
contact law, and it is called after each step.

`ContactLaw` is the interface that a march uses: how a step is solved, its memory, and where surfaces touch in saved
maps. Without an effect it is a constraint on pressures (`march.laws`). In the law of an effect the gap may be the
unknown.
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

from ..contact.problem import Box, Mask
from ..errors import Doubt, InputError
from ..job import Job, listing
from ..job.history import Step
from ..job.listing import effects_of
from ..job.parts import Part
from ..parallel.slab import Array
from ..physics.motion import Shear, Vector
from ..physics.records import Entry, Measures, Memory, Saved, Units

if TYPE_CHECKING:
    from ..contact.problem import Contact, Control
    from ..physics.body import Trial
    from ..physics.energy import EnergyMemory

Remembered = TypeVar("Remembered", covariant=True)
End = Literal["equilibrium", "detached", "opened", "open"]


class PreviousPressure(NamedTuple):
    """The pressure after a step and the position of the surface [m]. The pressure is `alpha p`, with p the map
    `pressure`, and is unknown if alpha is 0."""

    pressure: Array
    alpha: float = 0.0
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class PreviousContacts:
    """Memory of earlier contacts: the last pressures, the newest first, and the last approach d.

    A history of single solves stores one pressure, other histories two or more. `spare` receives the next pressure.
    """

    pressures: tuple[PreviousPressure, ...]
    spare: Array
    approach: float

    @property
    def last(self) -> PreviousPressure:
        return self.pressures[0]


@dataclass(frozen=True)
class SolvedContact(Generic[Remembered]):
    """The contact of a step, the law's memory after it, and a map `touching`, not 0 where the surfaces touch.

    `numbers`: further results of the law, by name. `pull`: force of all tension [N]. `least_load`: loads [N] up to this
    one are errors of the solver. `snapped`: the contact passed through states without equilibrium. `remark`: a sentence
    for run.log, or ''. `end` is one of

    * "equilibrium";
    * "detached": no equilibrium was left;
    * "opened": the run continues with the surfaces far from each other;
    * "open": a step after the surfaces have opened.
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
    """Motion of a contact in a step: `front` is the motion of its edges [half process zones], `untouched` is True if
    nothing touches or is under tension before and after the step, and `begins` if a contact that attracts begins or
    ends."""

    front: float = 0.0
    untouched: bool = False
    begins: bool = False


class Detached(NamedTuple):
    """Time [s] and load at which the surfaces detached."""

    time: float
    load: float


NEVER = -1.0  # a time [s] in a checkpoint


def entries_of_end(end: Detached | None, job: Any) -> dict[str, Entry]:
    """Return the checkpoint entries of a detachment, which is None before one, for a job."""
    time, load = end or (NEVER, 0.0)
    return {"detached at": Entry(time, 1.0, "s"), "detached under": Entry(load), "history": Entry(_mark(job))}


def end_in(job: Any, saved: Saved) -> Detached | None:
    """Return time and load of the detachment that a checkpoint of a law holds; None without one, or for another
    history."""
    if "detached at" not in saved or saved["detached at"] == NEVER or float(saved["history"]) != _mark(job):
        return None
    return Detached(float(saved["detached at"]), float(saved["detached under"]))


def _mark(job: Any) -> float:
    """Return a checksum of the history of a job."""
    return float(zlib.crc32(repr(job.history).encode()))


UNITS_OF_LOADS = {"pressure": " Pa", "force": " N", "approach": " m"}


def nothing_holds(control: str, load: float) -> str:
    """Return a sentence: the surfaces detach under a prescribed load."""
    return f"the surfaces detach under a {control} of {load:g}{UNITS_OF_LOADS[control]}"


class ContactLaw(Protocol[Memory]):
    """A contact law, a part of the run. Methods are collective.

    The usual law only bounds the pressure. A law that extends it may have a method `upon`, which takes the usual law
    and returns the extended law.
    """

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
        """Solve the contact of a step, and put the pressure into the spare map of `past`. `memory`, `past` and `before`
        are the law's memory, the contacts and the measures of the step before. A `tolerance` of None means the job's.
        The result has a `failure` if the solve failed."""

    def motion(self, solved: SolvedContact[Memory], before: Measures, now: Measures) -> EdgeMotion:
        """Return the motion of the contact in a step from its measures before and after it."""

    def gap(self, memory: Memory) -> Array | None:
        """Return the map of the gap if the gap is the unknown, else None."""

    def detached(self, memory: Memory) -> Detached | None:
        """Return time and load of the detachment; None before it."""

    def with_end(self, memory: Memory, end: Detached) -> Memory:
        """Return the memory with the detachment `end` added."""

    # -- as a part of the run ------------------------------------------------------------------------------------------

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries of a memory, by name."""

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory that a checkpoint holds."""


EXTRAPOLATION, TOLERANCES = "extrapolated starts", "looser tolerances"  # see `Effect.forbids`
SINGLE, BY_THEORY = "single precision", "Persson's theory"


@dataclass(frozen=True)
class Decision:
    """Decision about an effect: `on` or off, and the reason `why` in a few words."""

    name: str
    on: bool
    why: str


@dataclass(frozen=True)
class Sheared:
    """Effect of tractions along the surface in a step: the measures including tractions, their force [N] on the rigid
    surface, and the energy lost in slip [J]. With heat the map `slipping` is proportional to the power of slip; at
    rest, or if nothing slips, to the bounds of tractions. Tractions have the relative errors `error` of their solve,
    `time` of the step length, and `mesh` of the stiffness of spots; a `share` of them has the error of the area."""

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
    """A step just made, in the run's units unless stated; maps have the shape (ny_loc, nx) and are valid until the next
    step.

    The pressure is `modulus pressure`, `displacement` is the displacement of the body, and `touching` is not 0 where
    the surfaces touch. `before` and `measures` are the measures of the step before and of this step. In the step the
    surface moved by `moved` [m], and the stored plus dissipated energy of the body changed by `gained` [J], NaN without
    energies. Edges of a contact that attracts moved by `front` half process zones; `untouched` is True if nothing
    touched or was under tension before and after the step. `error_friction` is the estimated relative error of
    friction, infinite without friction.
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
        """Distance by which the surface moved in the step [m]."""
        return math.hypot(*self.moved)


@dataclass(frozen=True)
class Changes(Generic[Remembered]):
    """Changes that an effect makes in a step: its memory, a sentence for run.log or '', and `states_errors`, False if
    errors cannot be stated across the step. `turned` is the change of the mean traction over the mean bound of
    traction."""

    memory: Remembered
    remark: str = ""
    states_errors: bool = True
    sheared: Sheared | None = None
    turned: float = 0.0


class Effect(Protocol[Memory]):
    """Base class of effects, without memory. An object is made from a `Scene` only if the job asks for the effect, and
    is a part of the run. Methods are collective unless stated.

    Optional attributes: `rules`, checks of the whole job; `lifts`, checks of jobs that do not apply with the effect;
    `stage`, a class of stages with further keys. Optional functions of a job: `doubts` and `facts` yield warnings
    (`doubts.Doubt`, or sentences) and sentences about the section. `describe_waves` yields sentences on the waves of a
    surface on one grid, from bins of wavenumbers [rad/m] and their mean square slopes. `changed_material` returns a
    material that replaces the job's. `response`, also from a unit of length [m], returns the response of another body
    than a half space (`physics.halfspace.Response`). `why_no_curve` and `why_no_theory` return the reason why a job has
    no friction curve, or no prediction by Persson's theory, and `why_not_folded` why all branches need maps.
    `curve_options` yields the requirements of the effect's columns of friction curves (`Column.when`).
    """

    section: ClassVar[type[Part]]  # section that it adds to a job
    columns: ClassVar[tuple[str, ...]]  # columns that it adds to measures.csv
    fields: ClassVar[tuple[str, ...]] = ()  # maps that effects of this package add to those of output.fields
    in_bands_over_time: ClassVar[bool] = False  # True for classes of jobs in bands with a history, or with a rule on it
    in_curves: ClassVar[bool] = False  # True for classes that act in friction curves
    brings_law: ClassVar[bool] = False  # True for classes with a `law`; they exclude steady sliding
    forbids: ClassVar[Mapping[str, str]] = {}  # what is not done with it (EXTRAPOLATION, SINGLE, ...), with reasons

    def __init_subclass__(cls, **others: Any) -> None:
        super().__init_subclass__(**others)
        if "brings_law" not in vars(cls):
            cls.brings_law = cls.brings_law or "law" in vars(cls)

    @staticmethod
    def decide(job: Any) -> Decision:
        """Return the decision whether the job turns the effect on, with its name in checkpoints; equal on all ranks."""
        ...

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        """Return the types of the maps that the effect stores in checkpoints and in memory, for `parcontact plan`; the
        plan counts allocations instead for effects of this package."""
        return ()

    @staticmethod
    def shear(job: Any) -> Shear | None:
        """Return the friction of the contact area that the effect adds, in marches and in steady sliding, or None.
        Forces of all effects are added."""
        return None

    @staticmethod
    def touches(job: Any, pressure: Array, gap: Array) -> NDArray[Any] | None:
        """Return a map that is not 0 where surfaces touch, from saved maps of the pressure [Pa] and of the gap [m];
        None if the effect has no contact law. Local."""
        return None

    @staticmethod
    def remembers(job: Any) -> bool:
        """Return True if the contact depends on its history even for an elastic body."""
        return False

    @staticmethod
    def sheared_first(job: Any) -> bool:
        """Return True if the effect shears the contact before it slides, over much less than a wave."""
        return False

    @staticmethod
    def compares_heights(job: Any) -> bool:
        """Return True if warnings compare the heights of the surface with a length of the effect's section."""
        return False

    @staticmethod
    def chosen_values(job: Any) -> Mapping[str, float]:
        """Return the lengths [m] that the effect chooses by the mesh, by the names of their keys."""
        return {}

    @staticmethod
    def doubt_heights(job: Any, span: float) -> Iterator[Doubt]:
        """Yield warnings about a rough surface with the height `span` from the lowest to the highest point [m]."""
        yield from ()

    @staticmethod
    def doubt_contact(job: Any, measures: Measures, where: str) -> Iterator[Doubt]:
        """Yield warnings about the contact of a step; `where` is the place of the step in words."""
        yield from ()

    @staticmethod
    def doubt_cases(jobs: Sequence[Any]) -> Iterator[Doubt]:
        """Yield warnings about the differences between the jobs of a sweep."""
        yield from ()

    @staticmethod
    def ended(job: Any, saved: Saved) -> Detached | None:
        """Return the detachment that ended the run, from the law's entries in a checkpoint; None if the run goes on."""
        return None

    def __init__(self, scene: Any) -> None: ...

    def last_lines(self, memory: Memory) -> Iterator[str | Doubt]:
        """Yield sentences, and warnings about the results, for the end of a run; local."""
        yield from ()

    def law(self) -> ContactLaw[Any] | None:
        """Return the contact law of the steps; None if the effect has none."""
        return None

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""
        return None  # type: ignore[return-value]

    def follow(self, instant: Instant, memory: Memory) -> Changes[Memory]:
        """Return the changes that the effect makes after a step."""
        return Changes(memory)

    def values(self, memory: Memory) -> Sequence[float]:
        """Return the values of the effect's columns for the last step, equal on all ranks; NaN: an empty cell.
        Local."""
        return ()

    def field(self, memory: Memory, name: str) -> Array:
        """Return this rank's rows of the map `name` of the effect in SI units, as a new array."""
        ...

    def time_factor(self, memory: Memory) -> float:
        """Return the ratio of relaxation times after a step to those at the job's temperature. Raises RunError."""
        return 1.0

    def work(self, memory: Memory) -> float | None:
        """Return the work of the load since the start [J]; None if it is the work on the body."""
        return None

    def error_energy(self, memory: Memory) -> float | None:
        """Return the error of the energies since the start [J]; None for the usual estimate under pressure."""
        return None

    def further_energies(self, memory: Memory) -> tuple[EnergyMemory, float] | None:
        """Return energies of the body to be added to its energies under pressure, in the unit of the scene, and further
        losses of work [J]; None without such energies."""
        return None

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries of a memory, by name; maps belong to the memory or are made for this
        purpose."""
        return {}

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory that a checkpoint holds, in the run's units, numbers as arrays. Maps have been read into
        the maps of `entries`."""
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
    """Return an effect's class with checks: errors in an effect of another package name the effect, and maps of an
    instant are read-only for it."""
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
    """Return the names of the columns that effects add to measures.csv."""
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
    """Return the bounds of the pressure, if no effect has a law, in the `unit` [Pa]; pressures are at most `most`
    units."""
    hardness = job.material.hardness
    return Box() if hardness is None or hardness / unit >= most else Box(highest=hardness / unit)


def touching_of(job: Job, pressure: Array, gap: Array) -> Mask:
    """Return a map that is not 0 where surfaces touch, from saved maps of the pressure [Pa] and of the gap [m]."""
    for effect in effects_of(type(job).model_fields).values():
        touching = effect.touches(job, pressure, gap) if effect.decide(job).on and hasattr(effect, "touches") else None
        if touching is not None:
            return touching
    return constraint_of(job).touches(pressure)
