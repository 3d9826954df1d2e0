"""steady.csv and steady_waves.csv: a line for each point of a friction curve, on root, and what is said of it."""

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from .. import progress
from ..effects.interface import InterfaceColumns
from ..effects.thermal import ThermalColumns
from ..job import Job
from ..job.checks.advice import describe_sample
from ..job.sections.materials import describe_temperature
from ..physics.budget import advice, describe, exceeds
from ..scene import Setup
from ..storage import curve_points, files, tables
from ..storage.console import Console, always
from ..storage.curve_points import LOG, Wanted
from ..storage.tables import GrowingTable
from .heating import describe_hot
from .point import Point

COLUMNS = (
    *("velocity", "pressure", "force_x", "force_y", "friction", "contact_area", "approach", "mean_gap", "max_pressure"),
    *("residual", "penetration", "operator_calls", "seconds"),
)
LAST = ("friction_x", "contact_area_corrected")  # after the dissipation of the branches
ERRORS = ("error_friction", "error_area", "friction_slopes")
HEATED = ("temperature", "shift_factor")  # where temperatures are asked for
QUARTILES = ("lower_temperature", "upper_temperature")  # of the rise over the contact, with `thermal`
FEEDBACK = ("friction_cold", "flash_shift", "rounds")  # with the feedback of `thermal`
WAVES = ("steady_waves.csv", ("velocity", "pressure", "wavelength", "share"))  # a further table
FOUND: dict[str, Callable[[Point], float]] = {  # columns that are neither of the point nor of its measures by name
    "velocity": lambda point: point.speed,
    "pressure": lambda point: point.measures.pressure,
    "friction_x": lambda point: point.friction * (point.velocity[0] / point.speed),
    "friction_slopes": lambda point: point.measures.friction,
    "friction_viscous": lambda point: point.friction - point.measures.friction_interface,
    "residual": lambda point: point.certificate.worst,
    "penetration": lambda point: point.certificate.penetration,
    "operator_calls": lambda point: round(point.operator_calls, 2),
    "seconds": lambda point: round(point.seconds, 3),
    "error_area": lambda point: point.errors.area.total,
    "flash_temperature": lambda point: point.flash.mean if point.flash else math.nan,
    "max_temperature": lambda point: point.flash.highest if point.flash else math.nan,
    "lower_temperature": lambda point: point.flash.lower if point.flash else math.nan,
    "upper_temperature": lambda point: point.flash.upper if point.flash else math.nan,
    "flash_shift": lambda point: point.shift_factor,
}
HEAD = "velocity [m/s]    load [Pa] corr.area  error  friction  error  calls  residual"  # the area as corrected


def value_of(point: Point, name: str) -> float:
    """Return what a point has in a column, but those of the branches."""
    own = getattr(point, name, None) if name not in FOUND else FOUND[name](point)
    return float(getattr(point.measures, name) if own is None else own)


class CurveTable:
    """The tables in a directory, continued or begun; raises OSError, and InputError for one that cannot be read."""

    def __init__(
        self, directory: Path, setup: Setup, further: tuple[str, Sequence[str]] | None, heated: bool, quiet: bool
    ) -> None:
        self._console, self._job = Console(directory / LOG, quiet, 0), setup.job
        self.path, self.heated, self.quiet = directory / "steady.csv", heated, quiet
        branches = setup.prony.moduli.size if self._job.grid.boundary == "periodic" else 0
        self.interface = InterfaceColumns.columns if setup.choices.interface else ()
        thermal = self._job.section("thermal")
        self.thermal = (*ThermalColumns.columns, *QUARTILES) if thermal else ()
        self.thermal += FEEDBACK if thermal and thermal.feedback != "none" else ()
        added = (*(HEATED if heated else ()), *self.interface, *self.thermal)
        self._names = [*COLUMNS, *(f"dissipated_{k}" for k in range(branches)), *LAST, *added, *ERRORS]
        self.known = self._read()
        self._file = GrowingTable(self.path, self._names)
        self._further = GrowingTable(directory / further[0], further[1]) if further else None
        self._points: list[Point] = []
        self._bar = progress.Bar(0, "")
        if self._job.origin.mesh:
            self.say(self._job.origin.mesh)
        if not heated and (text := describe_temperature(self._job.material)):
            self.say(text)
        self.say(f"{HEAD}   T [C]" if heated else HEAD)

    def _read(self) -> list[Wanted]:
        """Return the points that are there; a line that was not finished is removed."""
        if not self.path.exists():
            return []
        columns = tables.read(self.path)
        if list(columns) != self._names:
            files.put_aside(self.path)
            return []
        whole = self.path.read_bytes()
        if not whole.endswith(b"\n"):
            with files.replaced(self.path) as new:
                new.write(whole[: whole.rfind(b"\n") + 1])
        return curve_points.of_table(columns)

    def lacking(self, points: Sequence[Wanted], bare: Sequence[int] = ()) -> list[int]:
        """Return the numbers of the points that are not there, or are `bare` of the maps that are asked for."""
        found = curve_points.lacking(points, self.known)
        if len(found) < len(points):
            self.say(f"{len(points) - len(found)} of {len(points)} points are there already")
        if again := sorted({*bare} - {*found}):
            self.say(f"{len(again)} of these are solved again, for their maps")
            found = sorted([*found, *again])
        self._bar = progress.Bar(len(found), "steady states", "point", not self.quiet)
        return found

    def pass_on(self) -> None:
        """Count a point, solved or not."""
        self._bar.step()

    def say(self, text: str) -> None:
        if not self.quiet or text.startswith("parcontact"):
            self._bar.print(text)
        self._console.log(text)

    def warn(self, texts: list[str], shown: Callable[[str], bool] = always) -> None:
        """Write warnings to the log, and show those that are `shown` even to those who asked for quiet."""
        for text in texts:
            self._console.warn(text, shown(text))

    def write(self, point: Point, rows: Sequence[Sequence[float]]) -> None:
        """Add a point, unless it was there before and is solved for its maps only."""
        m, speed = point.measures, point.speed
        if not curve_points.lacking([Wanted(speed, m.pressure, point.temperature)], self.known):
            return
        if self._further:
            for row in rows:
                self._further.append([repr(float(value)) for value in row])
        lost = {f"dissipated_{k}": power for k, power in enumerate(point.dissipated)}
        cells = [lost[name] if name in lost else value_of(point, name) for name in self._names]
        self._file.append(tables.texts(float(value) for value in cells))
        self._points.append(point)
        self.say(
            f"{speed:14.6g} {m.pressure:12.5g} {m.contact_area_corrected:9.5f} {_percent(point.errors.area.total)} "
            f"{point.friction:9.6f} "
            f"{_percent(point.error_friction)} {point.operator_calls:6.0f} "
            f"{point.certificate.worst:9.2e}{f' {point.temperature:7g}' if self.heated else ''}"
        )

    def conclude(self, failures: int) -> None:
        """Put a curve that was solved in parts into order, draw it, and say how it went; raises OSError."""
        self._bar.close()
        self._file.sync()
        if self.known:
            self._sort()
        self.warn(list(describe_hot(self._points)))
        self.warn(list(describe_missed(self._points, self._job)))
        if self._points and (text := describe_sample(self._job.grid, self._job.surface, slides=True)):
            self.say(text)
        from ..plotting import plots  # matplotlib is slow to import, and for pictures only

        picture = plots.draw_steady(self.path)
        failed = f"parcontact: {failures} of the points could not be solved; {self.path} has the others"
        self.say(failed if failures else f"done: {self.path} and {picture}")

    def _sort(self) -> None:
        """Sort the lines by temperature, then by pressure, then by speed."""
        columns = tables.read(self.path)
        head, *lines = self.path.read_text().splitlines()
        degrees = columns["temperature"] if self.heated else [0.0] * len(lines)
        points = zip(degrees, columns["pressure"], columns["velocity"], strict=True)
        keys = [(t, round(math.log(p), 5), v) for t, p, v in points]
        order = sorted(range(len(lines)), key=keys.__getitem__)
        files.write(self.path, "\n".join([head, *(lines[k] for k in order)]) + "\n")

    def close(self) -> None:
        self._bar.close()
        self._console.close()
        self._file.close()
        if self._further:
            self._further.close()


def describe_missed(points: Sequence[Point], job: Job) -> Iterator[str]:
    """Yield a sentence for friction and one for the corrected area, as far as points are more wrong than the job asks
    for."""
    chosen = ["solver"] * ("tolerance" in job.numerics.chosen) + ["mesh"] * bool(job.origin.mesh)
    friction = [(point, point.errors.friction) for point in points if point.errors.friction is not None]
    area = [(point, point.errors.area) for point in points]
    names = ("friction", "the corrected contact area")
    for name, each, accuracy in zip(names, (friction, area), job.numerics.asked.both, strict=True):
        missed = [(parts.total, point, parts) for point, parts in each if exceeds(parts.total, accuracy)]
        if missed:
            _, point, parts = max(missed, key=lambda one: one[0])
            place = Wanted(point.speed, point.pressure, point.temperature)
            yield (
                f"estimated error of {name} at {len(missed)} of {len(points)} points: up to {describe(parts)}, "
                f"at {place}{advice(parts, accuracy, chosen)}"
            )


def _percent(share: float) -> str:
    """Return a relative error in six characters."""
    return "     -" if math.isnan(share) else "> 100%" if share >= 1.0 else f"{100 * share:5.2g}%"
