"""Bands are coupled by an upward and a downward pass over all bands. Solved contacts are stored.

In the upward pass, from the finest band to the coarsest, each band is solved at the pressures of its ladder, with the
closing of all finer bands as the law of its interface. The approach of a band as a function of the pressure is the law
of the next coarser band. In the downward pass the distribution of pressure passes through the bands,

    P_0 = delta(p - p0),    P_k(p') = sum_j W_j F_k(p'|p_j),    W_j = int P_(k-1)(p) w_j(p) dp,
    mu = (1/p0) sum_k sum_j W_j tau_k(p_j),    area = sum_j W_j a_K(p_j),

with the friction stress tau_k and the share of contact a_k of band k under p_j, the distribution F_k of pressure within
band k under p_j, and the weights w_j of the rungs (`band.PressureLadder`). Contacts of one band are independent, so
that ranks share them.

Contacts of the present point of a friction curve are stored in a file. A run that was killed and is continued solves
only the missing contacts of this point.

The first line of the file names the program. Each other line is of one contact: a digest of all its input, and its
numbers. Numbers are read back exactly, so that repeated passes find the same states without a solve. An incomplete line
is ignored. Marches of `road_history` are stored in the same way.
"""

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..contact.problem import Box, Constraint, InterfaceLaw
from ..errors import InputError, RunError
from ..files import hdf5
from ..files.hdf5 import PROGRAM
from ..job import Job, listing
from ..parallel.slab import Array, Slab
from .band import Band, PressureLadder, Rung, Vector, probes_of
from .choice import Cut

IGNORED = ("title", "steady", "output")  # sections on which no contact depends
FIRST_LINE = f"{PROGRAM}\n"  # of the file of contacts
NAME = "bands.part"  # removed with all unfinished files when a curve starts again


class ContactStore:
    """Store of the solved contacts of a job, on root; methods are collective."""

    def __init__(self, slab: Slab) -> None:
        self._slab, self._job, self._path = slab, "", Path()
        self._known: dict[str, Rung] = {}

    def keep_in(self, directory: Path, job: Job, name: str = NAME) -> str:
        """Read the contacts in a file of this directory, and store further ones there. If the file is of another
        program, remove the file and return a sentence on this, on root; otherwise return ''. Raises RunError if the
        file cannot be read or written."""
        self._path = directory / name
        return self._on_root(lambda: self._read(job)) or ""

    def find(self, states: Sequence[Any], solve: Callable[[Sequence[int]], Sequence[Rung]]) -> list[Rung]:
        """Return one contact for each of `states`. A state is plain data that identify a contact of the job. `solve`
        takes the indices of the states whose contacts are not stored, and returns these contacts. Raises RunError if
        writing fails."""
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
        """Remove all contacts, once the point of the curve to which they belong is written."""
        self._known = {}
        if self._path.name:
            self._on_root(lambda: self._path.unlink(missing_ok=True))

    def _read(self, job: Job) -> str:
        self._job = repr({name: part for name, part in listing.plain_job(job).items() if name not in IGNORED})
        if not self._path.exists():
            return ""
        with self._path.open("r+b") as file:
            first = file.readline()
            if first.endswith(b"\n") and first != FIRST_LINE.encode():
                self._path.unlink()
                return f"{self._path} is not of {PROGRAM}: what it has is calculated again"
            whole = len(first) if first.endswith(b"\n") else 0
            for line in file:
                try:
                    digest, numbers = json.loads(line)
                    self._known[digest] = Rung(**{**_arrays(numbers), "found": _arrays(numbers["found"])})
                except (ValueError, TypeError, KeyError):
                    break
                whole += len(line)
            file.truncate(whole)
        return ""

    def _append(self, found: dict[str, Rung]) -> None:
        lines = [
            json.dumps([digest, asdict(rung)], default=lambda value: value.tolist()) for digest, rung in found.items()
        ]
        with self._path.open("a") as file:
            file.write("".join([*([FIRST_LINE] if not file.tell() else []), *(f"{line}\n" for line in lines)]))

    def _on_root(self, act: Callable[[], Any]) -> Any:
        return hdf5.write_on_root(self._slab, act, f"cannot keep the contacts of a point in {self._path}", RunError)


def _arrays(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: np.array(value) if isinstance(value, list) else value for name, value in values.items()}


T = TypeVar("T")
TINY = 1e-300  # rounding: least power, to avoid division by 0
NEGLIGIBLE = 1e-12  # accuracy: least share of the load of a rung that is solved without laws


class Task(NamedTuple):
    """One contact to solve: of one `band`, in one `sample` of the surface, under the mean pressure with the number
    `rung`. Numbers begin with 0. `law` is the approach of the mean planes as pressure squeezes finer bands."""

    band: int
    sample: int
    rung: int
    law: Constraint


@dataclass(frozen=True)
class BandResult:
    """Result of one band under a distribution of pressure.

    The band is solved at mean pressures p_j (rungs). `weights` are their weights W_j, and `load` is the sum of W_j p_j
    [Pa]. `friction` is the force of the band's waves over the whole load, from the dissipated power, and
    `friction_slopes` is this ratio from the pressures on slopes. Contact areas are shares of the nominal area, resolved
    down to the band's shortest wave. `load_lost` is the share of the load above the ladder. `powers` [W/m^2] are lost
    in each branch. `found` has the arrays of effects (`band.Probe`), averaged over the ladder. `errors`, shape (6,),
    are the absolute errors of friction by solver, time steps and grid, followed by the errors of area.
    """

    weights: Array
    load: float
    friction: float
    friction_slopes: float
    contact_area: float
    contact_area_corrected: float
    load_lost: float
    powers: Array
    found: Mapping[str, Array]
    errors: Array


class Shares(NamedTuple):
    """Shares of the mean pressures at which a band is solved (rungs), in a distribution of pressure. Rung j has the
    pressure p_j [Pa], the load W_j p_j [Pa] per nominal area, and a power in arbitrary units. `mean` is the mean
    pressure of the road [Pa]."""

    pressures: Array
    loads: Array
    mean: float
    power: Array


def by_load(shares: Shares) -> Array:
    """Return the weight of each mean pressure (rung): its share of the load."""
    return shares.loads / shares.loads.sum()


def by_square(shares: Shares) -> Array:
    """Return the weight of each mean pressure p_j (rung): its load times p_j, over the square of the road's mean
    pressure."""
    return shares.loads * shares.pressures / shares.mean**2


def by_power(shares: Shares) -> Array:
    """Return the weight of each mean pressure (rung): its share of the power; 0 if there is no power."""
    weights = np.maximum(shares.power, 0.0)
    return np.asarray(weights / max(float(weights.sum()), TINY))


Results = tuple[BandResult, ...]
Solved = Mapping[tuple[int, int], Sequence[Rung]]  # rungs by band and sample


class Cascade:
    """All bands of a job. Methods are collective.

    The contacts are distributed over the ranks of `slab`, whose grid is not used. Contacts in the `store` are not
    solved again.
    """

    def __init__(self, job: Job, cut: Cut, slab: Slab) -> None:
        self.job, self.cut, self.slab, self.store = job, cut, slab, ContactStore(slab)
        self._bands: dict[tuple[int, int], Band] = {}
        self._temperatures = [math.nan] * cut.count
        self._factors: tuple[Callable[[float], Any], list[float]] | None = None
        self._means = {name: mean for probe in probes_of(job, cut) for name, mean in probe.means.items()}
        self.velocity: Vector = (1.0, 0.0)
        self.ladders: list[PressureLadder] = []
        self.pressure = math.nan

    def band(self, number: int, sample: int) -> Band:
        """Return a band with the present velocity and temperature, made on this rank alone."""
        if (number, sample) not in self._bands:
            self._bands[number, sample] = Band(self.job, self.cut, number, sample)
            if not math.isnan(temperature := self._temperatures[number]):
                self._bands[number, sample].set_temperature(temperature)
            if self._factors is not None:
                at, values = self._factors
                self._bands[number, sample].set_factors(at(values[number]))
        found = self._bands[number, sample]
        found.slide(self.velocity)
        return found

    def set_temperatures(self, temperatures: Sequence[float]) -> None:
        """Set the temperature [deg C] of each band; NaN means the temperature of the material."""
        for (number, _), band in self._bands.items():
            if temperatures[number] != self._temperatures[number]:
                band.set_temperature(temperatures[number])
        self._temperatures = list(temperatures)

    def set_factors(self, at: Callable[[float], Any], values: Sequence[float]) -> None:
        """Set the factors by which the moduli are multiplied for each wave of a band: `at(values[band])`."""
        self._factors = at, list(values)
        for (number, _), band in self._bands.items():
            band.set_factors(at(values[number]))

    def press(self, velocity: Vector, pressure: float) -> None:
        """Set the velocity [m/s] and the mean pressure [Pa] of the road."""
        self.velocity, self.pressure = velocity, pressure
        squares = np.cumsum([0.0, *(self.band(k, 0).full_contact_rms ** 2 for k in range(self.cut.count))])
        self.ladders = [PressureLadder.over(pressure, math.sqrt(square)) for square in squares[:-1]]

    def climb(self, samples: Sequence[int]) -> dict[tuple[int, int], list[Rung]]:
        """Make the upward pass, separately for each sample: solve all bands, from the finest, at all pressures of their
        ladders. Under pressure the mean planes approach, as finer bands are squeezed. Return the results (`Rung`) of
        each (band, sample)."""
        found: dict[tuple[int, int], list[Rung]] = {}
        laws: dict[int, Constraint] = dict.fromkeys(samples, Box())
        touching = dict.fromkeys(samples, 0.0)
        for number in reversed(range(self.cut.count)):
            rungs = range(len(self.ladders[number].rungs))
            tasks = [Task(number, sample, rung, laws[sample]) for sample in samples for rung in rungs]
            solved = iter(self.solve_tasks(tasks))
            for sample in samples:
                own = [next(solved) for _ in rungs]
                found[number, sample] = [replace(rung, approach=rung.approach + touching[sample]) for rung in own]
                if number:
                    laws[sample], touching[sample] = self.closing_of(
                        number, [rung.approach for rung in found[number, sample]]
                    )
        return found

    def closing_of(self, number: int, approaches: Sequence[float] | Array) -> tuple[InterfaceLaw, float]:
        """Return the law c(p) by which a pressure squeezes a band and all finer bands, from the approaches [m] at the
        band's mean pressures (rungs), and the approach where c is 0. The residual of the solver may make an approach
        smaller than the approach under a lower pressure; such an approach is first raised to the larger one."""
        closings = np.maximum.accumulate(approaches)
        law = InterfaceLaw.of_table(self.ladders[number].rungs, closings)
        return law, float(closings[0] - law.closings[1])

    def fall(self, solve: Callable[[int, Array], Sequence[Rung]]) -> Results:
        """Make the downward pass: distribute the load over the mean pressures (rungs) of each band, and return the
        results of all bands. `solve(band, weights)` returns the results (`Rung`) of a band whose rungs have these
        weights."""
        weights, found, lost = np.ones(1), list[BandResult](), 0.0
        for number, ladder in enumerate(self.ladders):
            rungs = solve(number, weights)
            result = self._sum(weights, ladder, rungs)
            found.append(replace(result, load_lost=lost))
            loads = weights * ladder.rungs
            lost = float(sum(load * rung.load_lost for load, rung in zip(loads, rungs, strict=True)) / loads.sum())
            if number + 1 < self.cut.count:
                weights = np.sum([w * rung.weights for w, rung in zip(weights, rungs, strict=True)], axis=0)
        return tuple(found)

    def _sum(self, weights: Array, ladder: PressureLadder, rungs: Sequence[Rung]) -> BandResult:
        loads = weights * ladder.rungs
        energy = np.array([rung.friction for rung in rungs])
        areas = weights * [rung.contact_area_corrected for rung in rungs]
        errors = np.array([rung.errors for rung in rungs])
        shares = Shares(ladder.rungs, loads, self.pressure, loads * energy)
        return BandResult(
            weights,
            float(loads.sum()),
            float(loads @ energy) / self.pressure,
            float(loads @ [rung.friction_slopes for rung in rungs]) / self.pressure,
            min(float(weights @ [rung.contact_area for rung in rungs]), 1.0),
            min(float(areas.sum()), 1.0),
            0.0,
            np.sum([w * rung.powers for w, rung in zip(weights, rungs, strict=True)], axis=0),
            {name: mean(shares) @ np.array([rung.found[name] for rung in rungs]) for name, mean in self._means.items()},
            np.array([*(np.abs(loads * energy) @ errors[:, :3] / self.pressure), *(np.abs(areas) @ errors[:, 3:])]),
        )

    def hard(self, sample: int) -> Results:
        """Return the results of all bands of a sample if the roughness of finer bands is not squeezed (`Box`)."""

        def solve(number: int, weights: Array) -> Sequence[Rung]:
            ladder = self.ladders[number]
            there = np.flatnonzero(np.abs(weights) * ladder.rungs > NEGLIGIBLE * self.pressure)
            solved = self.solve_tasks([Task(number, sample, int(rung), Box()) for rung in there])
            nothing = replace(solved[0], friction=0.0, friction_slopes=0.0, contact_area=0.0)
            found = [nothing] * len(ladder.rungs)
            for rung, one in zip(there, solved, strict=True):
                found[rung] = one
            return found

        return self.fall(solve)

    def solve_tasks(self, tasks: Sequence[Task]) -> list[Rung]:
        """Return the contacts of the tasks in their order. Contacts that are not in the store are solved and stored.
        Raises RunError on all ranks if a solve fails."""
        laws = [tuple(np.asarray(value).tobytes() for value in vars(task.law).values()) for task in tasks]
        here = self.velocity, self.pressure, self._temperatures, self._factors and self._factors[1]
        states = [(here, task[:3], law) for task, law in zip(tasks, laws, strict=True)]
        return self.store.find(states, lambda lacking: self.share([tasks[number] for number in lacking], self._solve))

    def share(self, tasks: Sequence[T], solve: Callable[[T], Rung]) -> list[Rung]:
        """Solve each task on one rank, without the store, and return the results of all tasks in their order. Raises
        RunError on all ranks if a solve fails."""
        rank, size = self.slab.comm.rank, self.slab.comm.size
        own: list[Rung | None] = []
        problem = ""
        for task in tasks[rank::size]:
            try:
                own.append(solve(task))
            except (RunError, InputError) as error:
                problem = str(error)
                own.append(None)
        everyone = self.slab.from_all((own, problem))
        if problem := next((text for _, text in everyone if text), ""):
            raise RunError(problem)
        found: list[Rung] = []
        for index in range(len(tasks)):
            rung = everyone[index % size][0][index // size]
            assert rung is not None
            found.append(rung)
        return found

    def _solve(self, task: Task) -> Rung:
        below = self.ladders[task.band + 1] if task.band + 1 < self.cut.count else None
        pressure = float(self.ladders[task.band].rungs[task.rung])
        return self.band(task.band, task.sample).solve(pressure, task.law, below)


def mean_rungs(found: Solved, band: int, samples: Sequence[int]) -> list[Rung]:
    """Return the results of a band at each mean pressure for which it is solved, averaged over samples."""
    each = zip(*(found[band, sample] for sample in samples), strict=True)
    return [_mean(rungs) for rungs in each]


def _mean(rungs: Sequence[Rung]) -> Rung:
    if len(rungs) == 1:
        return rungs[0]
    worst = ("residual", "penetration", "max_pressure")
    values = {
        name: (max if name in worst else _average)([getattr(rung, name) for rung in rungs])
        for name in Rung.__dataclass_fields__
        if name != "found"
    }
    found = {name: _average([rung.found[name] for rung in rungs]) for name in rungs[0].found}
    return Rung(**values, found=found)


def _average(each: Sequence[Any]) -> Any:
    return sum(each) / len(each)
