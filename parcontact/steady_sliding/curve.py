"""Friction curves: steady sliding solved directly at many velocities and pressures, into steady.csv and a picture."""

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from .. import scene
from ..errors import InputError, RunError
from ..history.timeline import Timeline
from ..job import Job, identity
from ..parallel.signals import Signals
from ..parallel.slab import Array, Slab
from ..scene import sanity
from ..storage import curve_points, hdf5, marker, stopfile
from ..storage.console import always
from ..storage.directory import ADVICE, Directory
from ..storage.provenance import Link, Provenance
from ..storage.steady_maps import SteadyMaps
from ..storage.stopfile import StopFile
from .sliding import SteadySliding
from .table import CurveTable

DONE, FAILED, AGAIN = 0, 1, 3  # exit codes: all points solved; some have failed; stopped early, run again
SAME = (*marker.SCENE, *(f"numerics.{key}" for key in ("kernel", "precision", "slope", "tolerance")))


class Wanted(NamedTuple):
    """One steady state: speed [m/s], mean pressure [Pa], temperature [deg C], NaN for that of the material."""

    speed: float
    pressure: float
    temperature: float = math.nan


@dataclass(frozen=True)
class Request:
    """Which steady states: speeds [m/s] along a unit `direction`, each under each of the mean pressures [Pa], at each
    of the temperatures [deg C], if there are any."""

    velocities: tuple[float, ...]
    pressures: tuple[float, ...]
    direction: tuple[float, float] = (1.0, 0.0)
    waves: bool = False
    temperatures: tuple[float, ...] = ()

    @property
    def points(self) -> list[Wanted]:
        """All points, in the order in which they are solved."""
        found = curve_points.asked(self.velocities, self.pressures, self.temperatures)
        return [Wanted(*point) for point in found]

    def velocity(self, speed: float) -> tuple[float, float]:
        return speed * self.direction[0], speed * self.direction[1]


def request(
    job: Job, velocities: Sequence[float] = (), pressures: Sequence[float] = (), temperatures: Sequence[float] = ()
) -> Request:
    """What a job's `steady` section asks for, changed by what is given here; raises InputError if something lacks."""
    section = job.steady
    speeds = tuple(velocities) or (section.velocities if section else ())
    loads = tuple(pressures) or (section.pressures if section and section.pressures else _pressures(job))
    if not speeds:
        raise InputError("no velocities: give --velocities first:last:count [m/s], or a steady section in the job")
    if not loads:
        raise InputError("no pressure: give --pressures [Pa], or a stage with a pressure or force in the job")
    if any(not 0.0 < value < math.inf for value in (*speeds, *loads)):
        raise InputError("velocities [m/s] and pressures [Pa] of steady sliding must be positive")
    if job.grid.boundary == "free" and section and section.waves:
        raise InputError("steady.waves: the waves of a free scene are not independent; it needs a periodic one")
    direction = section.unit_direction if section else (1.0, 0.0)
    degrees = tuple(temperatures) or (section.temperatures if section and section.temperatures else ())
    for temperature in degrees:
        job.at_temperature(temperature)
    return Request(speeds, loads, direction, bool(section and section.waves), degrees)


def _pressures(job: Job) -> tuple[float, ...]:
    area = job.grid.lx * job.grid.ly
    for stage in job.history:
        if stage.control != "approach" and stage.load.end > 0.0:
            return (stage.load.end / area if stage.control == "force" else stage.load.end,)
    return ()


def run(
    job: Job,
    slab: Slab,
    wanted: Request,
    quiet: bool,
    restart: str = "auto",
    shows: Callable[[str], bool] = always,
    others_file: StopFile | None = None,
) -> int:
    """Solve all points that are not there yet, writing each at once; collective. Returns the exit code.

    A point that fails does so alone: the others are solved, and the exit code is 1. `restart` is `auto` or `never`;
    of the warnings those are printed that it `shows`. The file `others_file` stops it like its own stop file, and stays
    where it is.
    """
    directory = Directory(job.output.directory, slab, "steady")
    with directory.claimed():
        sanity.refuse_impossible(job, Timeline.of(job))
        plain = _identity(job, wanted) if slab.root else {}
        directory.refuse_foreign(job.path, plain, restart == "never")
        goes_on = _goes_on(directory, plain, slab) if restart != "never" else False
        setup = scene.set_up(job, slab)
        doubts = sanity.find_doubts(setup, wanted.temperatures)
        sliding = SteadySliding(setup)
        directory.make(job.path, job.resolved(), marker.Claim(plain))
        if not goes_on:
            directory.clear()
        columns = wanted.waves, bool(wanted.temperatures)
        table = _on_root(slab, lambda: CurveTable(directory.path, sliding, *columns, quiet))
        if table:
            table.warn(doubts, shows)
        maps = _maps(job, slab, wanted, directory)
        try:
            with Signals().noted() as signals:
                return _Curve(sliding, wanted, table, maps, directory, signals, shows, others_file).go()
        finally:
            if table:
                table.close()


def _identity(job: Job, wanted: Request) -> dict[str, Any]:
    """What a curve is of, as plain data: of the `steady` section only what no point may differ in."""
    return {
        **marker.kept(identity.plain_job(job)),
        "steady": {"direction": list(wanted.direction), "waves": wanted.waves},
    }


def _goes_on(directory: Directory, plain: Mapping[str, Any], slab: Slab) -> bool:
    """Whether points of the same curve are there; collective. Raises InputError if they are of another."""
    problem, there = "", False
    if slab.root and (claim := directory.claim) is not None and directory.results():
        there = True
        if different := "; ".join(marker.differences(claim.job, plain, (*SAME, "steady"))):
            problem = f"{directory.path} holds the friction curve of another job: {different}; {ADVICE}"
    if problem := slab.agree(problem):
        raise InputError(problem)
    return slab.agree(there)


def _on_root(slab: Slab, make: Any) -> CurveTable | None:
    found: list[CurveTable] = []
    hdf5.on_root(slab, lambda: found.append(make()), "cannot write the table of the curve", InputError)
    return found[0] if found else None


def _maps(job: Job, slab: Slab, wanted: Request, directory: Directory) -> SteadyMaps | None:
    """The file for the maps that the job asks for, if it does."""
    if not job.output.fields:
        return None
    provenance = Provenance((Link(job.resolved(), slab.comm.size),))
    path = directory.path / "steady.h5"
    points = [point if wanted.temperatures else point[:2] for point in wanted.points]
    return SteadyMaps(path, slab, job.grid.size, job.output.fields, points, provenance)


class _Curve:
    """The points of a curve, one after the other."""

    def __init__(
        self,
        sliding: SteadySliding,
        wanted: Request,
        table: CurveTable | None,
        maps: SteadyMaps | None,
        directory: Directory,
        signals: Signals,
        shows: Callable[[str], bool],
        others_file: StopFile | None,
    ) -> None:
        self.sliding, self.wanted, self.table, self.maps = sliding, wanted, table, maps
        self.directory, self.signals, self.slab = directory, signals, sliding.setup.slab
        job = sliding.setup.job
        self.shows, self.others_file = shows, others_file
        self.watch, self.failures = sanity.ContactWatch(job.numerics.strict, Timeline.of(job)), 0

    def go(self) -> int:
        """Solve what lacks; collective. Returns the exit code."""
        lacking = self.slab.agree(self.table.lacking(self.wanted.points) if self.table else [])
        for count, index in enumerate(lacking):
            if self._stopped():
                self._say(f"stopped with {len(lacking) - count} points to go; run again to go on")
                return AGAIN
            self._solve(index)
            if self.table:
                self.table.pass_on()
        if self.table:
            self.table.conclude(self.failures)
        return FAILED if self.failures else DONE

    def _stopped(self) -> bool:
        """Whether it is asked to stop; its own stop file is removed then; collective."""
        asked = self.signals.stop or (self.slab.root and self._file_asks())
        if not self.slab.reduce((), [float(asked)])[0]:
            return False
        if problem := self.slab.agree(stopfile.remove(self.directory.stop_file) if self.slab.root else ""):
            raise RunError(problem)
        return True

    def _file_asks(self) -> bool:
        others = self.others_file
        return os.path.lexists(self.directory.stop_file) or (others is not None and others.asks)

    def _say(self, text: str) -> None:
        if self.table:
            self.table.say(text)

    def _solve(self, index: int) -> None:
        speed, pressure, temperature = self.wanted.points[index]
        velocity = self.wanted.velocity(speed)
        at = f"{speed:g} m/s under {pressure:g} Pa" + (f" at {temperature:g} C" if temperature == temperature else "")
        try:
            if temperature == temperature:
                self.sliding.heat(temperature)
            point = self.sliding.solve(velocity, pressure)
        except RunError as error:
            self.failures += 1
            self._say(f"parcontact: {error}")
            return
        shares = self.sliding.shares(velocity) if self.wanted.waves else None
        if self.maps:
            self.maps.save(index, dict(self._fields()))
        table = self.table

        def write() -> None:
            if table:
                table.write(point, shares)
                table.warn(self.watch.judge_point(point.measures, at), self.shows)

        hdf5.on_root(self.slab, write, f"cannot write {self.directory.path / 'steady.csv'}")

    def _fields(self) -> Iterator[tuple[str, Array]]:
        """The maps of the last point that the job asks for, in SI units."""
        contact, setup = self.sliding.contact, self.sliding.setup
        assert contact is not None
        heights, unit = self.sliding.levels[0].heights, setup.units.height
        for name in setup.job.output.fields:
            if name == "pressure":
                yield name, contact.p * setup.units.pressure
            elif name == "displacement":
                yield name, contact.u * unit
            elif name == "height":
                yield name, heights * unit + setup.surface.datum
            else:
                yield name, (contact.u - heights - contact.d) * unit
