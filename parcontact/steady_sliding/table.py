"""steady.csv and steady_waves.csv: a line for each point of a friction curve, and messages about it; on root."""

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from .. import progress
from ..accuracy.budget import advice, describe, exceeds
from ..columns import STEADY, STEADY_WAVES, cells, choose_columns, names_of
from ..doubts import Doubt
from ..job import Job
from ..job.added_sections import answers
from ..job.checks.advice import describe_sample
from ..job.sections.materials import describe_temperature
from ..printed import per_cent
from ..scene import Setup
from ..storage import curve_points, files, lost_points, tables
from ..storage.console import Console, always
from ..storage.curve_points import LOG, Wanted
from ..storage.lost_points import LostPoint
from ..storage.tables import GrowingTable
from .point import Point

WAVES = ("steady_waves.csv", names_of(STEADY_WAVES))  # an additional table
HEAD = "velocity [m/s]    load [Pa] corr.area  error  friction  error  calls  residual"  # corr.area: corrected area


Draw = Callable[[], Path]  # draws the picture of a curve and returns its path


class EarlierPoint(NamedTuple):
    """A point solved by an earlier run, and its relative errors of friction and of the corrected area."""

    at: Wanted
    errors: tuple[float, float]


class CurveTable:
    """The tables in a directory, continued or new; raises OSError, and InputError for a table that cannot be read."""

    def __init__(
        self, directory: Path, setup: Setup, further: tuple[str, Sequence[str]] | None, heated: bool, quiet: bool
    ) -> None:
        self._console, self._job = Console(directory / LOG, quiet, 0), setup.job
        self.path, self.heated, self.quiet = directory / "steady.csv", heated, quiet
        branches = setup.prony.moduli.size if self._job.grid.boundary == "periodic" else 0
        thermal = self._job.section("thermal")
        there = {
            "temperatures": heated,
            "interface": bool(setup.choices.shears),
            "softening": self._job.section("softening") is not None,
            "thermal": thermal is not None,
            "feedback": thermal is not None and thermal.feedback != "none",
        }
        self._columns = choose_columns(STEADY, branches, [what for what, known in there.items() if known])
        self._names = names_of(self._columns)
        self.known = self._read()
        self._file = GrowingTable(self.path, self._names)
        self._lost = lost_points.read(directory)
        if further:
            self._keep_known(directory / further[0], heated)
        self._further = GrowingTable(directory / further[0], further[1]) if further else None
        self._points: list[Point] = []
        self._bar = progress.Bar(0, "")
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
        return curve_points.of_table(columns)

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
            kept += [] if curve_points.lacking([point], self.known) else [line]
        files.replace_file(path, "".join(f"{','.join(line)}\n" for line in [head, *kept]))

    def lacking(self, points: Sequence[Wanted], bare: Sequence[int] = ()) -> list[int]:
        """Return the numbers of the missing points, and of those `bare` of requested maps."""
        found = curve_points.lacking(points, self.known)
        if len(found) < len(points):
            self.say(f"{len(points) - len(found)} of {len(points)} points are there already")
        if again := sorted({*bare} - {*found}):
            self.say(f"{len(again)} of these are solved again, for their maps")
            found = sorted([*found, *again])
        self._bar = progress.Bar(len(found), "steady states", "point", not self.quiet)
        return found

    @property
    def count(self) -> int:
        """Number of points in the table."""
        return len(self.known) + len(self._points)

    def pass_on(self) -> None:
        """Count a point, solved or not."""
        self._bar.step()

    def say(self, text: str) -> None:
        if not self.quiet or text.startswith("parcontact"):
            self._bar.print(text)
        self._console.log(text)

    def warn(self, doubts: Sequence[Doubt], shown: Callable[[Doubt], bool] = always) -> None:
        """Write warnings to the log, and print those that are `shown`, also with --quiet."""
        for doubt in doubts:
            self._console.warn(str(doubt), shown(doubt))

    def write(self, point: Point, rows: Sequence[Sequence[float]]) -> None:
        """Add a point, unless it exists and is solved for its maps only."""
        m, speed = point.measures, point.speed
        if not curve_points.lacking([Wanted(speed, m.pressure, point.temperature)], self.known):
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
        """Store a point that could not be solved, unless it exists; raises OSError."""
        self._lost = lost_points.without([*lost_points.without(self._lost, [at]), LostPoint(at, why)], self.known)
        lost_points.write(self.path.parent, self._lost)

    def conclude(self, failures: int, draw: Draw | None) -> None:
        """Sort a curve that was solved in parts, `draw` it, and report failures; raises OSError."""
        self._bar.close()
        self._file.sync()
        if self.known:
            self._sort()
        found = [asked(self._points, self._job) for asked in answers("steady", "doubts_of_points")]
        of_points = [doubt for doubts in found for doubt in doubts]
        for warning in (*of_points, *describe_missed(self._points, self._job, self._earlier())):
            self._console.warn(str(warning))
        if self._points and (text := describe_sample(self._job.grid, self._job.surface, slides=True)):
            self.say(text)
        solved = [Wanted(point.speed, point.measures.pressure, point.temperature) for point in self._points]
        lost_points.write(self.path.parent, lost_points.without(self._lost, solved))
        picture = f" and {draw()}" if draw else ""
        there = lost_points.name_lost(self.path.parent) or "all points"
        failed = f"parcontact: {failures} of the points could not be solved; {self.path} has {there}"
        self.say(failed if failures else f"done: {self.path}{picture}")

    def _earlier(self) -> list[EarlierPoint]:
        """Return the points of earlier runs."""
        if not self.known:
            return []
        columns = tables.read_columns(self.path)
        errors = zip(columns["error_friction"], columns["error_area"], strict=True)
        there = map(EarlierPoint, curve_points.of_table(columns), errors)
        return [one for one in there if not curve_points.lacking([one.at], self.known)]

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


def describe_missed(points: Sequence[Point], job: Job, earlier: Sequence[EarlierPoint] = ()) -> Iterator[Doubt]:
    """Yield warnings about friction and the corrected area of points whose error exceeds the accuracy of the job, also
    of `earlier` ones, for which the parts of the error are not known."""
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
            yield Doubt("inaccurate points", "", {"of": name, "where": f"{many}: up to {text}"})
        elif before:
            error, place = max(before, key=lambda one: one[0])
            asked = f"more than the {100 * accuracy:g} % that numerics.accuracy asks for"
            where = f"{many}: up to {per_cent(error, 3)}, at {place}; {asked}"
            yield Doubt("inaccurate points", "", {"of": name, "where": where})


def _percent(share: float) -> str:
    """Return a relative error in six characters."""
    return "     -" if math.isnan(share) else "> 100%" if share >= 1.0 else f"{100 * share:5.2g}%"
