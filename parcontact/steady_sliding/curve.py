"""Friction curves: steady sliding solved directly at many velocities and pressures, into steady.csv and a picture."""

import csv
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import sanity, scene
from ..errors import InputError, RunError
from ..job import Job
from ..parallel.slab import Slab
from ..record import marker
from ..record.directory import Directory
from .sliding import Point, SteadySliding

COLUMNS = (
    "velocity,pressure,force_x,force_y,friction,contact_area,approach,mean_gap,max_pressure,"
    "residual,penetration,operator_calls,seconds"
)
LAST = ("friction_x", "contact_area_corrected")  # after the dissipation of the branches
HEAD = "velocity [m/s]    load [Pa]      area  friction  calls  residual"


@dataclass(frozen=True)
class Request:
    """Which steady states: speeds [m/s] along a unit `direction`, each under each of the mean pressures [Pa]."""

    velocities: tuple[float, ...]
    pressures: tuple[float, ...]
    direction: tuple[float, float] = (1.0, 0.0)
    waves: bool = False


def request(job: Job, velocities: Sequence[float] = (), pressures: Sequence[float] = ()) -> Request:
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
    return Request(speeds, loads, direction, bool(section and section.waves))


def _pressures(job: Job) -> tuple[float, ...]:
    area = job.grid.lx * job.grid.ly
    for stage in job.history:
        if stage.control != "approach" and stage.load.end > 0.0:
            return (stage.load.end / area if stage.control == "force" else stage.load.end,)
    return ()


def run(job: Job, slab: Slab, wanted: Request, quiet: bool) -> int:
    """Solve all points, writing each at once; collective. Returns the exit code: 1 if any of them has failed."""
    directory = Directory(job.output.directory, slab, "steady")
    with directory.claimed():
        sanity.refuse_impossible(job, job.timeline())
        plain = marker.plain_job(job) if slab.root else {}
        directory.refuse_foreign(job.path, plain, False)
        base = scene.frame(job, slab)
        doubts = [*job.warnings, *sanity.of_surface(base)]
        sliding = SteadySliding(base)
        directory.make(job.path, job.resolved(), marker.Claim(marker.kept(plain)))
        table = _Table(directory.path, sliding, wanted, quiet) if slab.root else None
        watch = sanity.ContactWatch(job, job.timeline())
        if table:
            table.warn(doubts)
        failures = 0
        for pressure in wanted.pressures:
            for speed in wanted.velocities:
                velocity = (speed * wanted.direction[0], speed * wanted.direction[1])
                try:
                    point = sliding.solve(velocity, pressure)
                except RunError as error:
                    failures += 1
                    if table:
                        table.say(f"parcontact: {error}")
                    continue
                shares = sliding.shares(velocity) if wanted.waves else None
                if table:
                    table.write(point, shares)
                    table.warn(watch.judge_point(point.measures, f"{speed:g} m/s under {pressure:g} Pa"))
        if table:
            table.close(failures)
    return 1 if failures else 0


class _Table:
    """Root's files and lines."""

    def __init__(self, directory: Path, sliding: SteadySliding, wanted: Request, quiet: bool) -> None:
        self.path, self.quiet = directory / "steady.csv", quiet
        branches = sliding.base.prony.moduli.size if sliding.base.job.grid.boundary == "periodic" else 0
        self._file = self.path.open("w", newline="")
        self._csv = csv.writer(self._file, lineterminator="\n")
        self._csv.writerow([*COLUMNS.split(","), *(f"dissipated_{k}" for k in range(branches)), *LAST])
        self._waves = (directory / "steady_waves.csv").open("w", newline="") if wanted.waves else None
        if self._waves:
            self._waves.write("velocity,pressure,wavelength,share\n")
        self.say(HEAD)

    def say(self, text: str) -> None:
        if not self.quiet or text.startswith("parcontact"):
            print(text, flush=True)

    def warn(self, texts: list[str]) -> None:
        """What is shown even to those who asked for quiet."""
        for text in texts:
            print(f"warning: {text}", file=sys.stderr, flush=True)

    def write(self, point: Point, shares: Any) -> None:
        m, c, speed = point.measures, point.certificate, math.hypot(*point.velocity)
        forces = (m.force_x, m.force_y, m.friction, m.contact_area, m.approach, m.mean_gap, m.max_pressure)
        solve = (c.worst, c.penetration, round(point.operator_calls, 2), round(point.seconds, 3))
        last = (m.friction_x, m.contact_area_corrected)
        self._csv.writerow([speed, m.pressure, *forces, *solve, *point.dissipated, *last])
        self._file.flush()
        if self._waves:
            for wavelength, share in zip(*shares, strict=True):
                self._waves.write(f"{speed!r},{m.pressure!r},{float(wavelength)!r},{float(share)!r}\n")
            self._waves.flush()
        self.say(
            f"{speed:14.6g} {m.pressure:12.5g} {m.contact_area:9.5f} {m.friction:9.6f} {point.operator_calls:6.0f} "
            f"{c.worst:9.2e}"
        )

    def close(self, failures: int) -> None:
        self._file.close()
        if self._waves:
            self._waves.close()
        from ..record import plots  # matplotlib is slow to import, and for pictures only

        picture = plots.draw_steady(self.path)
        self.say(f"done: {self.path} and {picture}" if not failures else f"parcontact: {failures} points have failed")
