"""The interface of effects: a decision from the job alone, and what is made, remembered and written where it is on.

An effect that follows the steps is one class, found by the section that it adds to a job (`job.added_sections`): no
other file knows it. One that takes the place of a part (another body, operator or path) has its decision in
`scene/choices.py`, and `scene/scene.py` makes it where it makes that part.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from numpy.typing import DTypeLike, NDArray

from ..errors import InputError
from ..history.timeline import Step
from ..job.sections.part import Part
from ..parallel.slab import Array
from ..physics.entries import Entry, Saved
from ..physics.measures import Measures
from ..physics.units import Units


@dataclass(frozen=True)
class Decision:
    """Decision whether an effect is on, and why in a few words."""

    name: str
    on: bool
    why: str


@dataclass(frozen=True)
class Instant:
    """A step just made, in the run's units unless others are given; maps are valid until the next step begins.

    The pressure on this rank's rows is `modulus pressure`, `displacement` that of the body, and `touching` is not 0
    where the surfaces touch; they have the shape (ny_loc, nx). `slid` [m] is by how much the surface moved in the step.
    """

    step: Step
    pressure: Array
    modulus: float
    displacement: Array
    touching: NDArray[Any]
    slid: float
    measures: Measures
    sticking: tuple[float, ...] | None = None


class Effect(Protocol):
    """The class of an effect that is told of every step made; made with a `Scene`, only where the job asks for it.

    It may have `rules` for the whole job, as sections have them, `lifts`: checks of other jobs that do not hold with
    it, and `doubts` and `facts`: functions of a job that give warnings, and what the section means in it. Methods are
    collective, unless they say otherwise. A class that inherits from this one remembers nothing, unless it says so.
    """

    section: ClassVar[type[Part]]  # what it adds to a job
    columns: ClassVar[tuple[str, ...]]  # what it adds to measures.csv

    @staticmethod
    def decide(job: Any) -> Decision:
        """Decide whether the job asks for it, and give its name in checkpoints; the same on every rank."""
        ...

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        """Return the types of the maps that it holds and that a checkpoint has; what else it holds is not planned."""
        return ()

    def __init__(self, scene: Any) -> None: ...

    def follow(self, instant: Instant) -> None:
        """Take note of a step that was made."""
        ...

    def values(self) -> Sequence[float]:
        """Return what its columns have in the row of the last step, the same on every rank; NaN leaves one empty.

        Local to this rank.
        """
        ...

    def entries(self, units: Units) -> dict[str, Entry]:
        """Return what it remembers after the last step, by name; maps are its own, or made for a checkpoint."""
        return {}

    def restore(self, saved: Saved) -> None:
        """Go on from what a checkpoint has of the entries, in the run's units, numbers as arrays.

        Maps have been read into those of `entries`.
        """
        ...


def columns_of(effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """Return the columns that effects add to measures.csv."""
    return tuple(name for effect in effects.values() for name in effect.columns)


def values_of(effects: Mapping[str, Effect]) -> tuple[float, ...]:
    """Return what effects have for their columns in the row of the last step; raises InputError for what does not
    fit."""
    return tuple(number for name, effect in effects.items() for number in _numbers(name, effect))


def _numbers(name: str, effect: Effect) -> list[float]:
    values, found = effect.values(), list[float]()
    with suppress(TypeError, ValueError):
        found = [float(value) for value in values]
    if len(found) != len(effect.columns):
        wanted = f"must give a number for each of its columns ({', '.join(effect.columns)})"
        raise InputError(f"the effect {name} cannot be used: its values() {wanted}, got {values!r:.80}")
    return found
