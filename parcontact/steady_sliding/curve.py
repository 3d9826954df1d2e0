"""Friction curves: steady sliding solved directly at many velocities and pressures, written to steady.csv and a
picture."""

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from .. import scene
from ..doubts import Doubt
from ..errors import InputError, RunError, UnsolvedError
from ..history.timeline import Timeline
from ..job import Job
from ..job.checks.cells import more_points
from ..job.sections import listing
from ..parallel.root import on_root
from ..parallel.signals import Signals
from ..parallel.slab import Array, Slab
from ..scene import Setup, sanity
from ..storage import curve_points, hdf5, lost_points, marker, stopfile, wisdom
from ..storage.console import always
from ..storage.curve_points import Wanted
from ..storage.directory import ADVICE, Directory
from ..storage.provenance import Link, Provenance, cite_lines
from ..storage.steady_maps import SteadyMaps
from ..storage.stopfile import StopFile
from .point import Point
from .sliding import SteadySliding
from .table import WAVES, CurveTable, Draw

DONE, FAILED, AGAIN = 0, 1, 3  # exit codes: all points solved; some have failed; stopped early, run again
SAME = (*marker.SCENE, *marker.EFFECTS, *(f"numerics.{key}" for key in ("kernel", "precision", "slope", "tolerance")))


@dataclass(frozen=True)
class Request:
    """Request for steady states: speeds [m/s] along a unit `direction`, each under each of the mean pressures [Pa] and
    at each of the temperatures [deg C], if there are any."""

    velocities: tuple[float, ...]
    pressures: tuple[float, ...]
    direction: tuple[float, float] = (1.0, 0.0)
    waves: bool = False
    temperatures: tuple[float, ...] = ()

    @property
    def points(self) -> list[Wanted]:
        """All points, in the order in which they are solved."""
        return curve_points.requested_points(self.velocities, self.pressures, self.temperatures)

    def velocity(self, speed: float) -> tuple[float, float]:
        return speed * self.direction[0], speed * self.direction[1]


def request(
    job: Job, velocities: Sequence[float] = (), pressures: Sequence[float] = (), temperatures: Sequence[float] = ()
) -> Request:
    """Return the request of a job's `steady` section, or of the arguments; raises InputError for an incomplete one."""
    section = job.steady
    speeds = tuple(velocities) or (section.velocities if section else ())
    loads = tuple(pressures) or (section.pressures if section and section.pressures else _pressures(job))
    if not speeds:
        raise InputError("no velocities: give --velocities first:last:count [m/s], or a steady section in the job")
    if not loads:
        raise InputError("no pressure: give --pressures [Pa], or a stage with a pressure or force in the job")
    if any(not 0.0 < value < math.inf for value in (*speeds, *loads)):
        raise InputError("velocities [m/s] and pressures [Pa] of steady sliding must be positive")
    for why in filter(None, (ask(job) for ask in job.asked("why_no_curve"))):
        raise InputError(why)
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


class States(Protocol):
    """Steady states of a job, one velocity and pressure after the other; collective.

    `setup` is the setup of the states. `table` is the name of an additional table with its columns, or None; `rows` are
    its lines for the last state at a velocity [m/s]. Intermediate results may be stored by `keep_in` a directory,
    until `forget` is called after the state is written.
    """

    setup: Setup
    table: tuple[str, Sequence[str]] | None

    def doubts(self, temperatures: Sequence[float]) -> list[Doubt]: ...

    def notes(self) -> list[str]: ...

    def keep_in(self, directory: Path) -> None: ...

    def forget(self) -> None: ...

    def set_temperature(self, temperature: float) -> None: ...

    def solve(self, velocity: tuple[float, float], pressure: float) -> Point: ...

    def rows(self, velocity: tuple[float, float]) -> list[list[float]]: ...

    def field(self, name: str) -> Array: ...


def on_one_grid(job: Job, slab: Slab) -> States:
    """Return the steady states of a job on its grid; collective."""
    return SteadySliding(scene.set_up(job, slab))


def transforms_of(job: Job) -> list[Any]:
    """Return facts that, with the number of ranks, determine the transforms of a curve."""
    return [*scene.choices(job).transforms, "curve"]


def run_curve(
    job: Job,
    slab: Slab,
    wanted: Request,
    quiet: bool,
    restart: str = "auto",
    shows: Callable[[Doubt], bool] = always,
    sweep_stop_file: StopFile | None = None,
    make: Callable[[Job, Slab], States] = on_one_grid,
    limit: float | None = None,
    draw: Draw | None = None,
) -> int:
    """Solve all missing points, and write each at once; collective. Return the exit code.

    If a point fails, the others are still solved, and the exit code is 1. `restart` is `auto` or `never`; warnings
    are printed if `shows` returns True. `sweep_stop_file` is shared by all cases of a sweep; it is not removed.
    `make` makes the steady states; `draw` draws the finished curve, on root. The last point must be solved by the time
    `limit` (of `time.monotonic`), if any.
    """
    directory = Directory(job.output.directory, slab, "steady")
    with directory.claimed():
        sanity.refuse_impossible(job, Timeline.from_job(job))
        plain = _identity(job, wanted) if slab.root else {}
        directory.refuse_foreign(job.path, plain, restart == "never")
        goes_on = restart != "never" and on_root(slab.comm, lambda: _goes_on(directory, plain))
        transforms = transforms_of(job)
        wisdom.recall(transforms, slab, None)
        sliding = make(job, slab)
        wisdom.keep(transforms, slab)
        doubts = sliding.doubts(wanted.temperatures)
        directory.make(job.path, job.resolved(), marker.Claim(plain))
        if not goes_on:
            directory.clear()
        table = _table(directory.path, sliding, wanted, quiet)
        if table:
            for text in sliding.notes():
                table.say(text)
            table.warn(doubts, shows)
        maps = _maps(job, slab, wanted, directory)
        sliding.keep_in(directory.path)
        try:
            with Signals().noted() as signals:
                return _Curve(sliding, wanted, table, maps, directory, signals, shows, sweep_stop_file, limit).go(draw)
        finally:
            if table:
                table.close()


def _identity(job: Job, wanted: Request) -> dict[str, Any]:
    """Return the data that identify a curve; of the `steady` section only those that must agree for all points."""
    steady = {"direction": list(wanted.direction), "waves": wanted.waves}
    return {**marker.kept(listing.plain_job(job)), "steady": steady}


def _goes_on(directory: Directory, plain: Mapping[str, Any]) -> bool:
    """Return whether points of the same curve exist; root only. Raises InputError if they belong to another curve, with
    advice on keeping several meshes."""
    if (claim := directory.claim) is None or not directory.results():
        return False
    if different := marker.list_differences(marker.differences(claim.job, plain, (*SAME, "steady"))):
        kept = marker.keep_mesh(claim.job, different)
        raise InputError(f"{directory.path} holds the friction curve of another job: {different}; {kept}{ADVICE}")
    return True


def _table(path: Path, sliding: States, wanted: Request, quiet: bool) -> CurveTable | None:
    """Start the tables, or continue them, on root; collective. Raises InputError if that fails."""
    further, made = WAVES if wanted.waves else sliding.table, list[CurveTable]()
    act = lambda: made.append(CurveTable(path, sliding.setup, further, bool(wanted.temperatures), quiet))  # noqa: E731
    hdf5.write_on_root(sliding.setup.slab, act, "cannot write the table of the curve", InputError)
    return made[0] if made else None


def _maps(job: Job, slab: Slab, wanted: Request, directory: Directory) -> SteadyMaps | None:
    """Make the file for the maps of the job, if it has some; collective."""
    if not job.output.fields:
        return None
    cited = cite_lines(listing.plain_data(job))
    provenance = Provenance((Link(job.resolved(), slab.comm.size),), references=cited)
    points = [point if wanted.temperatures else point[:2] for point in wanted.points]
    return SteadyMaps(directory.path / "steady.h5", slab, job.grid.size, job.output.fields, points, provenance)


@dataclass
class _Curve:
    """The points of a curve, solved one after the other; methods are collective."""

    sliding: States
    wanted: Request
    table: CurveTable | None
    maps: SteadyMaps | None
    directory: Directory
    signals: Signals
    shows: Callable[[Doubt], bool]
    sweep_stop_file: StopFile | None
    limit: float | None
    failures: int = 0
    longest: float = -math.inf

    def __post_init__(self) -> None:
        chosen, self.slab = self.sliding.setup.choices, self.sliding.setup.slab
        self.watch = sanity.ContactWatch(chosen.numerics.strict, chosen.timeline, more=more_points(chosen.grid))

    def go(self, draw: Draw | None) -> int:
        """Solve missing points; collective. Return the exit code."""
        bare = self.maps.lacking() if self.maps and self.slab.root else []
        lacking = self.slab.agree(self.table.lacking(self.wanted.points, bare) if self.table else [])
        for count, index in enumerate(lacking):
            if self._stopped():
                self._say(f"stopped with {len(lacking) - count} points to go; run again to go on")
                return AGAIN
            began = time.monotonic()
            self._solve(index)
            self.longest = max(self.longest, time.monotonic() - began)
            if self.table:
                self.table.pass_on()
        on_root(self.slab.comm, lambda: self.table.conclude(self.failures, draw) if self.table else None)
        if self.table:
            self.directory.note(finished=(self.table.count, 0.0))
        return FAILED if self.failures else DONE

    def _stopped(self) -> bool:
        """Return whether a stop was requested, or a point that takes twice the longest time so far would come too late;
        its own stop file is then removed."""
        late = self.limit is not None and time.monotonic() + 2.0 * self.longest > self.limit
        others = late or (self.sweep_stop_file is not None and self.sweep_stop_file.asks)
        asked = self.signals.stop or (self.slab.root and (others or os.path.lexists(self.directory.stop_file)))
        if not self.slab.reduce((), [float(asked)])[0]:
            return False
        if problem := self.slab.agree(stopfile.remove(self.directory.stop_file) if self.slab.root else ""):
            raise RunError(problem)
        return True

    def _say(self, text: str) -> None:
        if self.table:
            self.table.say(text)

    def _lose(self, wanted: Wanted, error: RunError) -> None:
        """Report and store a point that could not be solved."""
        self.failures += 1
        self._say(f"parcontact: {error}")
        why = error.reason if isinstance(error, UnsolvedError) else str(error)
        act = lambda: self.table.lose(wanted, why) if self.table else None  # noqa: E731
        hdf5.write_on_root(self.slab, act, f"cannot write {self.directory.path / lost_points.FILE}")
        self.sliding.forget()

    def _solve(self, index: int) -> None:
        """Solve and write a point; a failure is reported."""
        wanted, table = self.wanted.points[index], self.table
        velocity = self.wanted.velocity(wanted.speed)
        try:
            if not math.isnan(wanted.temperature):
                self.sliding.set_temperature(wanted.temperature)
            point = self.sliding.solve(velocity, wanted.pressure)
        except RunError as error:
            self._lose(wanted, error)
            return
        rows = self.sliding.rows(velocity) if self.wanted.waves or self.sliding.table else []
        if self.maps:
            self.maps.save(index, {name: self.sliding.field(name) for name in self.maps.names})

        def write() -> None:
            if table:
                table.write(point, rows)
                table.warn(self.watch.check_point(point.measures, str(wanted)), self.shows)

        hdf5.write_on_root(self.slab, write, f"cannot write {self.directory.path / 'steady.csv'}")
        self.sliding.forget()
