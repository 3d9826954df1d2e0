"""Friction curves: steady sliding solved directly at many velocities and pressures.

Each point of a curve is a line of steady.csv. If the losses by wavelength are requested, steady_waves.csv has one line
per octave of wavelengths for each point. Root writes these tables, messages and a picture of the curve.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from .. import printed
from ..columns import STEADY, STEADY_WAVES, cells, choose_columns, names_of
from ..errors import DONE, FAILED, STOPPED_EARLY, Doubt, InputError, Kind, RunError, UnsolvedError
from ..files import files, hdf5, outputs, tables, wisdom
from ..files.fields import SteadyMaps
from ..files.hdf5 import Link, Provenance, cite_lines
from ..files.outputs import ADVICE, Directory
from ..files.recorder import Console
from ..files.stopping import Options, Watch, always, watching
from ..files.tables import GrowingTable, LostPoint, Wanted
from ..job import Job, listing
from ..job.advice import describe_sample
from ..job.history import Timeline
from ..job.listing import answers
from ..job.materials import describe_temperature
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab
from ..printed import per_cent
from . import choices, sanity, scene
from .budget import MESH_OF_BANDS, advice, describe, exceeds
from .scene import Setup
from .steady import Point, SteadySliding

HEAD = "velocity [m/s]    load [Pa] corr.area  error  friction  error  calls  residual"  # corr.area: corrected area


Draw = Callable[[], Path]  # draws the picture of a curve and returns its path


class EarlierPoint(NamedTuple):
    """A point solved by an earlier run, with its relative errors of friction and of the corrected area."""

    at: Wanted
    errors: tuple[float, float]


class CurveTable:
    """The tables of a friction curve in a directory. Raises OSError if a table cannot be written, and InputError if a
    table cannot be read."""

    def __init__(
        self, directory: Path, setup: Setup, further: tuple[str, Sequence[str]] | None, heated: bool, quiet: bool
    ) -> None:
        self._console, self._job = Console(directory / outputs.STEADY.log, quiet, 0), setup.job
        self.path, self.heated, self.quiet = directory / outputs.STEADY.table, heated, quiet
        branches = setup.prony.moduli.size if self._job.grid.boundary == "periodic" else 0
        options = [option for asked in self._job.asked("curve_options") for option in asked(self._job)]
        there = [*options, *["temperatures"] * heated, *["shear"] * bool(setup.choices.shears)]
        self._columns = choose_columns(STEADY, branches, there)
        self._names = names_of(self._columns)
        self.known = self._read()
        self._file = GrowingTable(self.path, self._names)
        self._lost = tables.read(directory)
        if further:
            self._keep_known(directory / further[0], heated)
        self._further = GrowingTable(directory / further[0], further[1]) if further else None
        self._points: list[Point] = []
        self._bar = printed.Bar(0, "")
        if self._job.origin.mesh:
            self.say(self._job.origin.mesh)
        if not heated and (text := describe_temperature(self._job.material)):
            self.say(text)
        self.say(f"{HEAD}   T [C]" if heated else HEAD)

    def _read(self) -> list[Wanted]:
        """Return the points of the table; an incomplete line is removed."""
        if not self.path.exists():
            return []
        columns = tables.read_columns(self.path)
        if tuple(columns) != self._names:
            files.put_aside(self.path)
            return []
        whole = self.path.read_bytes()
        if not whole.endswith(b"\n"):
            with files.replaced(self.path) as new:
                new.write(whole[: whole.rfind(b"\n") + 1])
        return tables.of_table(columns)

    def _keep_known(self, path: Path, heated: bool) -> None:
        """Remove lines of an additional table that belong to no point, such as one that was interrupted."""
        if not path.exists():
            return
        head, *lines = tables.whole_lines(path)
        places = [head.index(name) for name in ("velocity", "pressure", "temperature") if name in head]
        kept = []
        for line in lines:
            speed, pressure, *degrees = (float(line[place] or "nan") for place in places)
            point = Wanted(speed, pressure, degrees[0] if heated and degrees else math.nan)
            kept += [] if tables.lacking_points([point], self.known) else [line]
        files.replace_file(path, "".join(f"{','.join(line)}\n" for line in [head, *kept]))

    def lacking(self, points: Sequence[Wanted], bare: Sequence[int] = ()) -> list[int]:
        """Return the indices of the points that must be solved. They are the points that the table lacks, and the
        points with the indices `bare`, whose requested maps are missing."""
        found = tables.lacking_points(points, self.known)
        if len(found) < len(points):
            self.say(f"{len(points) - len(found)} of {len(points)} points are there already")
        if again := sorted({*bare} - {*found}):
            self.say(f"{len(again)} of these are solved again, for their maps")
            found = sorted([*found, *again])
        self._bar = printed.Bar(len(found), "steady states", "point", not self.quiet)
        return found

    @property
    def count(self) -> int:
        """Number of points in the table."""
        return len(self.known) + len(self._points)

    def pass_on(self) -> None:
        """Advance the progress bar by one point, solved or not."""
        self._bar.step()

    def say(self, text: str) -> None:
        if not self.quiet or text.startswith("parcontact"):
            self._bar.print(text)
        self._console.log(text)

    def warn(self, doubts: Sequence[Doubt], shown: Callable[[Doubt], bool] = always) -> None:
        """Write warnings to the log, and print the warnings for which `shown` returns True, even with --quiet."""
        for doubt in doubts:
            self._console.warn(str(doubt), shown(doubt))

    def write(self, point: Point, rows: Sequence[Sequence[float]]) -> None:
        """Add the lines of a point to the tables. If the table has a line for this point already, nothing is written:
        the point was solved again only for its maps."""
        m, speed = point.measures, point.speed
        if not tables.lacking_points([Wanted(speed, m.pressure, point.temperature)], self.known):
            return
        if self._further:
            for row in rows:
                self._further.append(cells(map(float, row)))
        self._file.append(cells(float(column.value(point)) for column in self._columns))
        self._points.append(point)
        self.say(
            f"{speed:14.6g} {m.pressure:12.5g} {m.contact_area_corrected:9.5f} {_percent(point.error_area)} "
            f"{point.friction:9.6f} "
            f"{_percent(point.error_friction)} {point.operator_calls:6.0f} "
            f"{point.certificate.worst:9.2e}{f' {point.temperature:7g}' if self.heated else ''}"
        )

    def lose(self, at: Wanted, why: str) -> None:
        """Record that a point could not be solved, with the reason `why`. A point that the table has is not recorded.
        Raises OSError."""
        self._lost = tables.without([*tables.without(self._lost, [at]), LostPoint(at, why)], self.known)
        tables.write(self.path.parent, self._lost)

    def conclude(self, failures: int, draw: Draw | None) -> None:
        """Sort the points of a curve, which may have been solved in any order, draw the curve by `draw`, and report the
        number of `failures`. Raises OSError."""
        self._bar.close()
        self._file.sync()
        if self.known:
            self._sort()
        for warning in doubt_points(self._points, self._job, self._earlier()):
            self._console.warn(str(warning))
        if self._points and (text := describe_sample(self._job.grid, self._job.surface, slides=True)):
            self.say(text)
        solved = [Wanted(point.speed, point.measures.pressure, point.temperature) for point in self._points]
        tables.write(self.path.parent, tables.without(self._lost, solved))
        picture = f" and {draw()}" if draw else ""
        there = tables.name_lost(self.path.parent) or "all points"
        failed = f"parcontact: {failures} of the points could not be solved; {self.path} has {there}"
        self.say(failed if failures else f"done: {self.path}{picture}")

    def _earlier(self) -> list[EarlierPoint]:
        """Return the points of earlier runs."""
        if not self.known:
            return []
        columns = tables.read_columns(self.path)
        errors = zip(columns["error_friction"], columns["error_area"], strict=True)
        there = map(EarlierPoint, tables.of_table(columns), errors)
        return [one for one in there if not tables.lacking_points([one.at], self.known)]

    def _sort(self) -> None:
        """Sort the lines by temperature, then by pressure, then by speed."""
        columns = tables.read_columns(self.path)
        head, *lines = self.path.read_text().splitlines()
        degrees = columns["temperature"] if self.heated else [0.0] * len(lines)
        points = zip(degrees, columns["pressure"], columns["velocity"], strict=True)
        keys = [(t, round(math.log(p), 5), v) for t, p, v in points]
        order = sorted(range(len(lines)), key=keys.__getitem__)
        files.replace_file(self.path, "\n".join([head, *(lines[k] for k in order)]) + "\n")

    def close(self) -> None:
        self._bar.close()
        self._console.close()
        self._file.close()
        if self._further:
            self._further.close()


WARN_INACCURATE_POINTS = Kind("inaccurate points", "estimated error of {of} {where}")


def doubt_points(points: Sequence[Point], job: Job, earlier: Sequence[EarlierPoint] = ()) -> Iterator[Doubt]:
    """Yield warnings about the solved points of a curve: first the warnings of effects, then warnings about errors that
    exceed the accuracy (`describe_missed`)."""
    for asked in answers("steady", "doubts_of_points", job):
        yield from asked(points, job)
    yield from describe_missed(points, job, earlier)


def describe_missed(points: Sequence[Point], job: Job, earlier: Sequence[EarlierPoint] = ()) -> Iterator[Doubt]:
    """Yield warnings about points whose error of friction or of the corrected area exceeds the accuracy of the job.

    Points of `earlier` runs count, too. Only the sums of their errors are known, not the parts by source.
    """
    chosen = ["solver"] * ("tolerance" in job.numerics.chosen) + ["mesh"] * bool(job.origin.mesh)
    known = [point for point in points if point.errors.resolved]
    friction = [(point, point.errors.friction) for point in known if point.errors.friction is not None]
    area = [(point, point.errors.area) for point in known]
    names = ("friction", "the corrected contact area")
    for column, (name, each) in enumerate(zip(names, (friction, area), strict=True)):
        accuracy = job.numerics.asked.both[column]
        missed = [(parts.total, point, parts) for point, parts in each if exceeds(parts.total, accuracy)]
        before = [(one.errors[column], one.at) for one in earlier if exceeds(one.errors[column], accuracy)]
        many = f"at {len(missed) + len(before)} of {len(points) + len(earlier)} points"
        if missed:
            _, point, parts = max(missed, key=lambda one: one[0])
            place = Wanted(point.speed, point.pressure, point.temperature)
            text = f"{describe(parts, name)}, at {place}{advice(parts, accuracy, chosen)}"
            yield WARN_INACCURATE_POINTS("", {"of": name, "where": f"{many}: up to {text}"})
        elif before:
            error, place = max(before, key=lambda one: one[0])
            asked = f"more than the {100 * accuracy:g} % that numerics.accuracy asks for"
            where = f"{many}: up to {per_cent(error, 3)}, at {place}; {asked}"
            yield WARN_INACCURATE_POINTS("", {"of": name, "where": where})


def _percent(share: float) -> str:
    """Return a relative error in six characters."""
    return "     -" if math.isnan(share) else "> 100%" if share >= 1.0 else f"{100 * share:5.2g}%"


@dataclass(frozen=True)
class Request:
    """Request for steady states at each combination of velocity, pressure and temperature.

    The surface moves along the unit vector `direction` with the speeds `velocities` [m/s] under the mean `pressures`
    [Pa]. `temperatures` [deg C] are empty if the job's temperature is used. `waves` is True if the losses by wavelength
    are requested.
    """

    velocities: tuple[float, ...]
    pressures: tuple[float, ...]
    direction: tuple[float, float] = (1.0, 0.0)
    waves: bool = False
    temperatures: tuple[float, ...] = ()

    @property
    def points(self) -> list[Wanted]:
        """All points, in the order in which they are solved."""
        return tables.requested_points(self.velocities, self.pressures, self.temperatures)

    def velocity(self, speed: float) -> tuple[float, float]:
        return speed * self.direction[0], speed * self.direction[1]


def request(
    job: Job, velocities: Sequence[float] = (), pressures: Sequence[float] = (), temperatures: Sequence[float] = ()
) -> Request:
    """Return the request for a friction curve. Velocities [m/s], pressures [Pa] and temperatures [deg C] that are not
    given as arguments are taken from the job's section `steady`. Raises InputError if velocities or pressures are
    missing or not positive, or if an effect of the job forbids friction curves."""
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
    """Solver of the steady states of a job, one velocity and pressure after the other; all methods are collective.

    `table` is the name of an additional table and the names of its columns, or None. `rows` returns the lines of this
    table for the last state, solved at a velocity [m/s].

    After a call of `keep_in(directory)`, intermediate results of a state may be stored in this directory. `forget`
    removes the intermediate results once the state is written. `keep_in` removes intermediate results of another
    version of the program and returns a sentence on this, otherwise ''.
    """

    setup: Setup
    table: tuple[str, Sequence[str]] | None

    def doubts(self, temperatures: Sequence[float]) -> list[Doubt]: ...

    def notes(self) -> list[str]: ...

    def keep_in(self, directory: Path) -> str: ...

    def forget(self) -> None: ...

    def set_temperature(self, temperature: float) -> None: ...

    def solve(self, velocity: tuple[float, float], pressure: float) -> Point: ...

    def rows(self, velocity: tuple[float, float]) -> list[list[float]]: ...

    def field(self, name: str) -> Array: ...


def on_one_grid(job: Job, slab: Slab) -> States:
    """Return the solver of steady states of a job on its grid; collective."""
    return SteadySliding(scene.set_up(job, slab))


def watch_contacts(setup: Setup, job: Job) -> sanity.ContactWatch:
    """Return the checks of the contacts of a curve of `job`; `setup` is that of its grid or its coarsest band. Each
    kind of warning is given once for the whole curve."""
    chosen = setup.choices
    finer = MESH_OF_BANDS if job.bands is not None else sanity.finer_cells(chosen.grid)
    return sanity.ContactWatch(chosen.numerics.strict, chosen.timeline, finer)


def solve_point(sliding: States, wanted: Request, at: Wanted) -> Point:
    """Return the steady state at one of the `wanted` points; collective. Raises RunError."""
    if wanted.temperatures:
        sliding.set_temperature(at.temperature)
    return sliding.solve(wanted.velocity(at.speed), at.pressure)


def transforms_of(job: Job) -> list[Any]:
    """Return settings that, together with the number of ranks, determine the transforms of a curve. Plans of transforms
    that an earlier curve has stored on this machine are found by these settings (`files.wisdom`)."""
    return [*choices.choices(job).transforms, "curve"]


def run_curve(
    job: Job,
    slab: Slab,
    wanted: Request,
    options: Options,
    make: Callable[[Job, Slab], States] = on_one_grid,
    draw: Draw | None = None,
) -> int:
    """Solve all missing points of a friction curve, and write each point as soon as it is solved; collective. Return
    the exit code.

    If a point fails, the others are still solved, and the exit code is 1. The option `restart` is `auto` or `never`.
    `make` returns the solver of the steady states. `draw` draws the finished curve, on root.
    """
    directory = Directory(job.output.directory, slab, "steady")
    with directory.claimed():
        sanity.refuse_impossible(job, Timeline.from_job(job))
        steady = {"direction": list(wanted.direction), "waves": wanted.waves}  # in which all points agree
        plain = {**outputs.kept(listing.plain_job(job)), "steady": steady} if slab.root else {}
        directory.refuse_foreign(job.path, plain, options.restart == "never")
        goes_on = options.restart != "never" and on_root(slab.comm, lambda: _goes_on(directory, plain))
        transforms = transforms_of(job)
        wisdom.recall(transforms, slab, None)
        sliding = make(job, slab)
        wisdom.keep(transforms, slab)
        doubts = sliding.doubts(wanted.temperatures)
        directory.make(job.path, job.resolved(), outputs.Claim(plain))
        if not goes_on:
            directory.clear()
        table = _table(directory.path, sliding, wanted, options.quiet)
        if table:
            for text in sliding.notes():
                table.say(text)
            table.warn(doubts, options.shows)
        maps = _maps(job, slab, wanted, directory)
        renewed = sliding.keep_in(directory.path)
        if table and renewed:
            table.say(renewed)
        try:
            with watching(directory, job.checkpoint, options) as watch:
                contacts = watch_contacts(sliding.setup, job)
                return _Curve(sliding, wanted, table, maps, directory, watch, contacts, options.shows).go(draw)
        finally:
            if table:
                table.close()


def _goes_on(directory: Directory, plain: Mapping[str, Any]) -> bool:
    """Return whether points of the same curve exist; root only. Raises InputError if they belong to another curve, with
    advice on keeping several meshes."""
    if (claim := directory.claim) is None or not directory.results():
        return False
    if different := outputs.STEADY.changes(claim.job, plain):
        kept = outputs.keep_mesh(claim.job, different)
        raise InputError(f"{directory.path} holds the friction curve of another job: {different}; {kept}{ADVICE}")
    return True


def _table(path: Path, sliding: States, wanted: Request, quiet: bool) -> CurveTable | None:
    """Start the tables, or continue them, on root; collective. Raises InputError if that fails."""
    further, made = (outputs.WAVES, names_of(STEADY_WAVES)) if wanted.waves else sliding.table, list[CurveTable]()
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
    return SteadyMaps(directory.path / outputs.STEADY.maps, slab, job.grid.size, job.output.fields, points, provenance)


@dataclass
class _Curve:
    """The points of a curve, solved one after the other; methods are collective."""

    sliding: States
    wanted: Request
    table: CurveTable | None
    maps: SteadyMaps | None
    directory: Directory
    watch: Watch
    contacts: sanity.ContactWatch
    shows: Callable[[Doubt], bool]
    failures: int = 0

    def __post_init__(self) -> None:
        self.slab = self.sliding.setup.slab

    def go(self, draw: Draw | None) -> int:
        """Solve the missing points of the curve; collective. Return the exit code."""
        bare = self.maps.lacking if self.maps else []
        lacking = self.slab.agree(self.table.lacking(self.wanted.points, bare) if self.table else [])
        for count, index in enumerate(lacking):
            verdict = self.watch.decide(count, count > 0)
            if verdict.problem:
                raise RunError(verdict.problem)
            if verdict.stop:
                self._say(f"stopped with {len(lacking) - count} points to go; run again to go on")
                return STOPPED_EARLY
            self._solve(index)
            if self.table:
                self.table.pass_on()
        on_root(self.slab.comm, lambda: self.table.conclude(self.failures, draw) if self.table else None)
        if self.table:
            self.directory.note(finished=(self.table.count, 0.0))
        return FAILED if self.failures else DONE

    def _say(self, text: str) -> None:
        if self.table:
            self.table.say(text)

    def _lose(self, wanted: Wanted, error: RunError) -> None:
        """Report and store a point that could not be solved."""
        self.failures += 1
        self._say(f"parcontact: {error}")
        why = error.reason if isinstance(error, UnsolvedError) else str(error)
        act = lambda: self.table.lose(wanted, why) if self.table else None  # noqa: E731
        hdf5.write_on_root(self.slab, act, f"cannot write {self.directory.path / outputs.LOST}")
        self.sliding.forget()

    def _solve(self, index: int) -> None:
        """Solve and write a point; a failure is reported."""
        wanted, table = self.wanted.points[index], self.table
        try:
            point = solve_point(self.sliding, self.wanted, wanted)
        except RunError as error:
            self._lose(wanted, error)
            return
        rows = self.sliding.rows(self.wanted.velocity(wanted.speed)) if self.wanted.waves or self.sliding.table else []
        if self.maps:
            self.maps.save(index, {name: self.sliding.field(name) for name in self.maps.names})

        def write() -> None:
            if table:
                table.write(point, rows)
                table.warn(self.contacts.check_point(point.measures, str(wanted)), self.shows)

        hdf5.write_on_root(self.slab, write, f"cannot write {self.directory.path / outputs.STEADY.table}")
        self.sliding.forget()
