"""Interface of effects: a decision from the job alone, and what is made, remembered and written if the effect is on.

An effect is one class, found by the section that it adds to a job (`job.added_sections`); no other file refers to
it. It may provide the contact law, and it is called after each step.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import wraps
from inspect import getattr_static, isfunction
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeVar

from numpy.typing import DTypeLike, NDArray

from ..doubts import Doubt
from ..errors import InputError
from ..history.timeline import Step
from ..job import added_sections
from ..job.sections.part import Part
from ..parallel.slab import Array
from ..physics.entries import Entry, Memory, Saved
from ..physics.interface_friction import Shear, Vector
from ..physics.measures import Measures
from ..physics.units import Units
from .contact_protocol import ContactLaw, Detached, SolvedContact

if TYPE_CHECKING:  # what computes is not loaded to check a job
    from ..physics.energy import EnergyMemory

Remembered = TypeVar("Remembered", covariant=True)
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
    surface, and the energy lost in slip [J]. With `thermal` the map `slipping` is in proportion to the power of slip;
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
    friction curve, and no prediction by Persson's theory. Methods are collective unless stated. The base class has no
    memory.
    """

    section: ClassVar[type[Part]]  # section that it adds to a job
    columns: ClassVar[tuple[str, ...]]  # columns that it adds to measures.csv
    fields: ClassVar[tuple[str, ...]] = ()  # maps that effects of this package add to those of output.fields
    in_bands_over_time: ClassVar[bool] = False  # True for classes that jobs in bands with a history may have
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

    def further_energies(self, memory: Memory) -> "tuple[EnergyMemory, float] | None":
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
            with added_sections.naming_effect(self._section):
                return member(*given, **named)

        return call


def guarded(section: str, effect: type[Effect[Any]]) -> type[Effect[Any]]:
    """Return the class of an effect. Errors in an effect of another package name it, and maps of an instant are
    read-only for it."""
    if added_sections.is_ours(section):
        return effect

    def guard(name: str, method: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(method)
        def call(*given: Any) -> Any:
            instants = [one for one in given if isinstance(one, Instant)]
            with added_sections.naming_effect(section), ExitStack() as kept:
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
