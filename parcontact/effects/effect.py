"""Interfaces that an effect and a contact law implement.

An effect is one class. The program finds the class by the section that the effect adds to a job (`job.listing`); no
other file refers to the class. The class decides from the job alone whether the effect acts, and states the columns,
maps and memory that the effect adds. The effect is called after each step, and may provide the contact law.

`ContactLaw` is the interface to a contact law in a march: the solution of a step, the memory of the law, and where
surfaces touch in saved maps. If no effect provides a law, the law only bounds the pressure (`march.laws`). A law of an
effect may have the gap as its unknown instead of the pressure.
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
from ..physics.records import Entry, Measures, Memory, Saved, Units
from ..physics.surface import Shear, Vector

if TYPE_CHECKING:
    from ..contact.problem import Contact, Control
    from ..physics.body import Trial
    from ..physics.energy import EnergyMemory

Remembered = TypeVar("Remembered", covariant=True)
End = Literal["equilibrium", "detached", "opened", "open"]


class PreviousPressure(NamedTuple):
    """The pressure after a step, and the position of the surface [m] at that time.

    The pressure is `alpha` times the map `pressure`, in the run's unit of pressure. `alpha` is the modulus of the body
    in that step. It is 0 if the pressure is not known.
    """

    pressure: Array
    alpha: float = 0.0
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class PreviousContacts:
    """Contacts of earlier steps: their pressures, the newest first, and the last approach.

    In a history of single solves only the last pressure is kept, in other histories two or more. The solver writes the
    pressure of the next contact into the map `spare`.
    """

    pressures: tuple[PreviousPressure, ...]
    spare: Array
    approach: float

    @property
    def last(self) -> PreviousPressure:
        return self.pressures[0]


@dataclass(frozen=True)
class SolvedContact(Generic[Remembered]):
    """The solution of a step: the contact, the memory of the law after the step, and a map `touching`, which is not 0
    where the surfaces touch.

    `numbers` are further results of the law by name. `pull` is the force of all tension [N]. A load of at most
    `least_load` [N] is not distinguished from 0, as it may be an error of the solver. `snapped` is True if the contact
    passed through states without equilibrium. `remark` is a sentence for run.log, or ''. `end` is one of

    * "equilibrium";
    * "detached": the surfaces separated, since no equilibrium in contact was left;
    * "opened": the surfaces separated in this step, and the run continues;
    * "open": the surfaces had separated in an earlier step.
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
        """True if the surfaces press or pull each other anywhere."""
        return self.least_load < math.inf


class EdgeMotion(NamedTuple):
    """Motion of a contact in a step.

    `front` is the distance by which the edges of contact moved, divided by half the length of the zone in which
    surfaces separate. `untouched` is True if no point touches or is under tension before the step, and none after the
    step. `begins` is True if surfaces that attract each other come into contact, or lose contact, in the step.
    """

    front: float = 0.0
    untouched: bool = False
    begins: bool = False


class Detached(NamedTuple):
    """Time [s] and load at which the surfaces detached."""

    time: float
    load: float


NEVER = -1.0  # a time [s] in a checkpoint


def entries_of_end(end: Detached | None, job: Any) -> dict[str, Entry]:
    """Return the checkpoint entries of a job's law for the detachment `end`; `end` is None as long as the surfaces have
    not detached."""
    time, load = end or (NEVER, 0.0)
    return {"detached at": Entry(time, 1.0, "s"), "detached under": Entry(load), "history": Entry(_mark(job))}


def end_in(job: Any, saved: Saved) -> Detached | None:
    """Return the time and the load of the detachment in a checkpoint. Return None if the surfaces have not detached, or
    if the checkpoint belongs to a job with another history."""
    if "detached at" not in saved or saved["detached at"] == NEVER or float(saved["history"]) != _mark(job):
        return None
    return Detached(float(saved["detached at"]), float(saved["detached under"]))


def _mark(job: Any) -> float:
    """Return a checksum of the history of a job."""
    return float(zlib.crc32(repr(job.history).encode()))


UNITS_OF_LOADS = {"pressure": " Pa", "force": " N", "approach": " m"}


def nothing_holds(control: str, load: float) -> str:
    """Return a sentence that states the load under which the surfaces detach. `control` names the kind of load:
    pressure, force or approach. `load` is its value in SI units."""
    return f"the surfaces detach under a {control} of {load:g}{UNITS_OF_LOADS[control]}"


class ContactLaw(Protocol[Memory]):
    """The interface of a contact law, which solves the contact of each step and has a memory. Methods are collective.

    The usual law only bounds the pressure. A law that builds on the usual law has a method `upon`, which takes the
    usual law and returns the law to be used.
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
        """Solve the contact of a step, and put its pressure into the map `past.spare`.

        The state before the step is given by the law's `memory`, by the contacts `past` and by the measures `before`.
        If `tolerance` is None, the job's tolerance is used. If the solve fails, `contact.failure` of the result states
        why.
        """

    def motion(self, solved: SolvedContact[Memory], before: Measures, now: Measures) -> EdgeMotion:
        """Return the motion of the contact in a step. `before` and `now` are the measures before and after the step."""

    def gap(self, memory: Memory) -> Array | None:
        """Return the map of the gap if the law solves for the gap, else None."""

    def detached(self, memory: Memory) -> Detached | None:
        """Return the time and the load at which the surfaces detached; None if they have not."""

    def with_end(self, memory: Memory, end: Detached) -> Memory:
        """Return the memory with the detachment `end` added."""

    # -- as a part of the run ------------------------------------------------------------------------------------------

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries of a memory, by name."""

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`."""


EXTRAPOLATION, TOLERANCES = "extrapolated starts", "looser tolerances"  # see `Effect.forbids`
SINGLE, BY_THEORY = "single precision", "Persson's theory"


@dataclass(frozen=True)
class Decision:
    """Decision whether the effect `name` acts: `on` is True if it acts, and `why` is the reason in a few words."""

    name: str
    on: bool
    why: str


@dataclass(frozen=True)
class Sheared:
    """Results of tractions along the surface in a step.

    `measures` are the measures of the step including tractions. `force` [N] is the force of all tractions on the rigid
    surface, and `lost` [J] the energy lost in slip. The map `slipping` is proportional to the heat that slip releases
    at each point. If nothing slips, the map is proportional to the largest traction that the interface can bear.

    Three numbers are relative errors of the tractions: `error` is due to the solve, `time` to the length of the step,
    and `mesh` to the stiffness of contact spots on the mesh. The error of the contact area affects only the fraction
    `share` of the tractions.
    """

    measures: Measures
    force: Vector
    lost: float
    slipping: Array
    error: float = 0.0
    share: float = 0.0
    time: float = 0.0
    mesh: float = 0.0

    def error_of_tractions(self, of_area: float) -> float:
        """Return the relative error of the tractions, for the relative error `of_area` of the contact area."""
        return self.error + self.share * of_area + self.time + self.mesh


@dataclass(frozen=True)
class Instant:
    """A step just made. Values are in the run's units unless a unit is stated. Maps have the shape (ny_loc, nx) and are
    valid until the next step.

    The pressure is the number `modulus` times the map `pressure`. `displacement` is the displacement of the body, and
    `touching` is not 0 where the surfaces touch. `before` and `measures` are the measures before and after the step. In
    the step the surface moved by the vector `moved` [m]. `gained` [J] is the change of the sum of stored and dissipated
    energy of the body, NaN if energies are not computed. `front` and `untouched` are as in `EdgeMotion`.
    `error_friction` is the estimated relative error of friction, infinite without friction.
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
    """Changes that an effect makes in a step.

    `memory` is the memory of the effect after the step, and `remark` is a sentence for run.log, or ''. `states_errors`
    is False if errors cannot be stated across this step. `turned` is the change of the mean traction, divided by the
    mean over the contact of the largest traction that the interface can bear.
    """

    memory: Remembered
    remark: str = ""
    states_errors: bool = True
    sheared: Sheared | None = None
    turned: float = 0.0


class Effect(Protocol[Memory]):
    """Base class of effects, without memory. An object is made from a `Scene` only if the job asks for the effect, and
    takes part in each step of the run. Methods are collective unless stated.

    A class may have further attributes. `rules` are checks of the whole job. `lifts` are checks of the package that are
    left out if the effect is on. `stage` is a class of stages with further keys.

    A class may also have these functions of a job, all of them optional:

    * `doubts` yields warnings about the section (`errors.Doubt`, or sentences), and `facts` yields sentences.
    * `describe_waves` yields sentences on the waves of a surface on one grid. It takes the job, and the wavenumber
      [rad/m] and the mean square slope of each bin of waves.
    * `changed_material` returns a material that replaces the job's.
    * `response` takes the job and the unit of length [m], and returns the response of a body that is no half space
      (`physics.halfspace.Response`).
    * `why_no_curve` returns the reason why the job has no friction curve, `why_no_theory` the reason why Persson's
      theory cannot predict its results, and `why_not_folded` the reason why each branch of the material needs a map.
      All return '' if there is no reason.
    * `curve_options` yields the options for which friction curves have further columns (`Column.when`).
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
        """Return the decision whether the job turns the effect on. The `name` of the decision is the effect's name in
        checkpoints. All ranks must return the same decision."""
        ...

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        """Return the types of the maps that the effect stores in checkpoints and in memory. `parcontact plan` uses
        these types for effects of other packages. For effects of this package, the plan counts allocations instead."""
        return ()

    @staticmethod
    def shear(job: Any) -> Shear | None:
        """Return the shear that the effect exerts on the contact area, in marches and in steady sliding, or None. The
        forces of all effects are added."""
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
        """Return True if the effect shears the contact before it slides, over a distance much smaller than the waves of
        the surface."""
        return False

    @staticmethod
    def compares_heights(job: Any) -> bool:
        """Return True if warnings compare the heights of the surface with a length of the effect's section."""
        return False

    @staticmethod
    def chosen_values(job: Any) -> Mapping[str, float]:
        """Return the lengths [m] that the effect chooses from the mesh, by the names of their keys."""
        return {}

    @staticmethod
    def doubt_heights(job: Any, span: float) -> Iterator[Doubt]:
        """Yield warnings about a rough surface, whose lowest and highest points differ by `span` [m]."""
        yield from ()

    @staticmethod
    def doubt_contact(job: Any, measures: Measures, where: str) -> Iterator[Doubt]:
        """Yield warnings about the contact of a step; `where` names the step in words."""
        yield from ()

    @staticmethod
    def doubt_cases(jobs: Sequence[Any]) -> Iterator[Doubt]:
        """Yield warnings about the differences between the jobs of a sweep."""
        yield from ()

    @staticmethod
    def ended(job: Any, saved: Saved) -> Detached | None:
        """Return the detachment that ended the run, which the law saved in a checkpoint; None if the run can go on."""
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
        """Return the effect's memory after a step, with what else the effect changes (`Changes`)."""
        return Changes(memory)

    def values(self, memory: Memory) -> Sequence[float]:
        """Return the values of the effect's columns for the last step, equal on all ranks. NaN becomes an empty cell.
        Local."""
        return ()

    def field(self, memory: Memory, name: str) -> Array:
        """Return this rank's rows of the map `name` of the effect in SI units, as a new array."""
        ...

    def time_factor(self, memory: Memory) -> float:
        """Return the relaxation times after a step, divided by those at the job's temperature. Raises RunError."""
        return 1.0

    def work(self, memory: Memory) -> float | None:
        """Return the work of the load since the start [J]; None if it equals the work done on the body."""
        return None

    def error_energy(self, memory: Memory) -> float | None:
        """Return the error of the energies since the start [J]; None if the usual estimate for energies under pressure
        is right."""
        return None

    def further_energies(self, memory: Memory) -> tuple[EnergyMemory, float] | None:
        """Return what the effect adds to the energies of the body under pressure: further energies of the body, in the
        unit of the scene, and the work that is lost outside the body [J]. Return None if the effect adds nothing."""
        return None

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries of a memory, by name. Maps among them are maps of the memory, or new maps."""
        return {}

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`. Numbers in `saved`
        are arrays in the run's units."""
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
    """Return the class of an effect, with checks if another package has registered it: errors name the effect, and the
    effect cannot change the maps of an instant."""
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
    """Return the values of all columns of effects for the last step; raises InputError if an effect does not give a
    number for each of its columns."""
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
    """Return the bounds of the pressure for a job whose effects have no contact law. Both the bounds and `most` are in
    `unit` [Pa]. The upper bound is the hardness of the material. There is no upper bound if the material has no
    hardness, or if the hardness is above `most`."""
    hardness = job.material.hardness
    return Box() if hardness is None or hardness / unit >= most else Box(highest=hardness / unit)


def touching_of(job: Job, pressure: Array, gap: Array) -> Mask:
    """Return a map that is not 0 where surfaces touch, from saved maps of the pressure [Pa] and of the gap [m]."""
    for effect in effects_of(type(job).model_fields).values():
        touching = effect.touches(job, pressure, gap) if effect.decide(job).on and hasattr(effect, "touches") else None
        if touching is not None:
            return touching
    return constraint_of(job).touches(pressure)
