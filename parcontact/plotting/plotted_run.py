"""The results of a run that its picture is drawn from."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..history.timeline import Timeline
from ..job import Job
from ..job.resolved import RESOLVED, STEADY_RESOLVED, shown_job
from ..parallel.slab import Array
from ..storage import marker, read_back
from ..summary import pull_off
from . import prefixes
from .charts import FRACTION, Axis

MEASURED = (
    *("step", "time", "distance", "pressure", "friction", "friction_x", "contact_area", "contact_area_corrected"),
    *("approach", "mean_gap", "max_pressure", "work", "stored", "dissipated"),
)
NEAREST = 3  # steps with maps that a message names


class PlottedRun:
    """A run's job and rows. The rows before the first load of a body at rest are left out: nothing has happened yet."""

    def __init__(self, directory: Path) -> None:
        self.directory, self.job = directory, shown_job(directory / RESOLVED)
        self.area = self.job.grid.lx * self.job.grid.ly  # of the box [m^2]
        self.free = self.job.grid.boundary == "free"
        self._all = read_table(directory / "measures.csv", MEASURED)
        if not self._all["step"].size:
            raise InputError(f"{directory} holds no step yet")
        first = int(self._all["pressure"][0] == 0.0 and self._all["step"].size > 1)
        self.columns = {name: values[first:] for name, values in self._all.items()}
        self.lasts, self.slides = self._all["time"][-1] > 0.0, self._all["distance"][-1] > 0.0

    @property
    def load(self) -> tuple[Axis, Array]:
        return to_load(self.columns["pressure"], self.area * self.free)

    @property
    def in_contact(self) -> tuple[Axis, Array]:
        """The contact area as corrected for the cells on its edge."""
        return to_contact_area(self.columns["contact_area_corrected"], self.area * self.free)

    @property
    def backwards(self) -> bool:
        """Whether the surface moves along x only, and towards -x in a stage: the magnitude of friction has a cusp."""
        velocities = [stage.velocity for stage in self.job.history]
        return any(x < 0.0 for x, _ in velocities) and not any(y for _, y in velocities)

    @property
    def curves(self) -> bool:
        """Whether there is anything to draw over time or load: a single solve is a few numbers."""
        return bool(self.lasts) or len(set(self.columns["pressure"])) > 1

    @cached_property
    def timeline(self) -> Timeline:
        """The stage of the job that each step is in."""
        steps, times = self._all["step"].astype(int).tolist(), self._all["time"].tolist()
        return Timeline.from_job(self.job, times[-1]).follow(dict(zip(steps, times, strict=True)))

    @property
    def telling_step(self) -> int:
        """The step whose maps show the contact: the last one, or where the surfaces came off that of the pull-off or of
        the largest load."""
        columns = {name: values.tolist() for name, values in self._all.items()}
        row = pull_off.choose_row(columns, bool(marker.detached(self.directory)))
        return int(self._all["step"][row])

    @property
    def rows_of_stages(self) -> dict[int, list[int]]:
        """The rows of each stage, by its number; the initial state belongs to the first."""
        found: dict[int, list[int]] = {}
        for row, step in enumerate(self.columns["step"].astype(int).tolist()):
            if (stage := self._stage(step)) >= 0:
                found.setdefault(stage, []).append(row)
        return found

    def _stage(self, step: int) -> int:
        """Return the stage of a step, -1 where the job knows of none."""
        step = max(step, 1)
        return self.timeline.span(step).index if step <= len(self.timeline) else -1

    def instant(self, step: int, time: float) -> str:
        """Return when a map was saved and what pressed then: `2.1 ms, 100 kPa`, `150 mN`, `2.1 ms, approach 20 µm`."""
        when = prefixes.quantity(time, "s", 4) if self.lasts else ""
        return ", ".join(filter(None, (when, self.pressed(step))))

    def pressed(self, step: int) -> str:
        """Return what presses after a step, as its stage prescribes it; '' where no row tells."""
        rows, stage = np.flatnonzero(self._all["step"] == step), self._stage(step)
        if not rows.size:
            return ""
        if stage >= 0 and self.job.history[stage].control == "approach":
            return f"approach {prefixes.quantity(self._all['approach'][rows[-1]], 'm')}"
        axis, loads = to_load(self._all["pressure"], self.area * self.free)
        return prefixes.quantity(loads[rows[-1]], axis.unit)

    def name_stage(self, step: int) -> str:
        """Return the name that the job gives to the stage of a step; '' where it gives none."""
        stage = self._stage(step)
        name = self.job.history[stage].name if stage >= 0 else ""
        return "" if name == f"stage {stage + 1}" else name

    def moved(self, step: int) -> tuple[float, float]:
        """Return where the surface is after a step [m]; where it began if the job does not know of that step."""
        return self.timeline[step].position if 1 <= step <= len(self.timeline) else (0.0, 0.0)


class Fields:
    """The saved maps of a run. `shown` are the instants to draw: the one that was asked for, else all; `chosen` is the
    one of these whose maps are drawn, the last by default.

    `at` is a step, as a whole number, or a time [s]: of a step the maps must be saved, of a time they are the nearest.
    """

    def __init__(self, file: h5py.File, at: str = "", until: int | None = None) -> None:
        self.file = file
        self.steps: NDArray[np.int64] = file["step"][...]
        self.x, self.y = file["x"][...], file["y"][...]
        self.times: Array = file["t"][...]
        self.saved = np.flatnonzero(~np.isnan(self.times)).tolist()
        self.shown = [self._index(at)] if at else self.saved
        before = [k for k in self.shown if until is None or self.steps[k] <= until]
        self.chosen = (before or self.shown or [-1])[-1]

    def read(self, name: str) -> Array | None:
        """Return the map of a name at the chosen instant, if it was saved."""
        field = self.file[name][self.chosen] if name in self.file and self.shown else None
        return field if field is not None and np.isfinite(field).all() else None

    def _index(self, at: str) -> int:
        """Return the instant that is asked for; raises InputError where no map is saved then."""
        if not self.saved:
            raise InputError(f"--at {at}: no map is saved yet")
        steps, times = self.steps[self.saved], self.times[self.saved]
        if not at.isdecimal() and not times[0] <= float(at) <= times[-1]:
            raise InputError(f"--at {at}: maps are saved from {times[0]:g} to {times[-1]:g} s")
        order = np.argsort(np.abs(steps - int(at) if at.isdecimal() else times - float(at)), kind="stable")
        if at.isdecimal() and int(at) not in steps:
            near = ", ".join(map(str, sorted(steps[order[:NEAREST]])))
            raise InputError(f"--at {at}: no map is saved after step {at}; the nearest steps with maps are {near}")
        return int(self.saved[order[0]])


def choose_evenly(labels: dict[int, str], most: int) -> dict[int, str]:
    """Return at most so many instants, evenly, the first and the last among them."""
    indices = list(labels)
    kept = np.linspace(0, len(indices) - 1, min(len(indices), most)).astype(int)
    return {indices[k]: labels[indices[k]] for k in kept}


def label_frames(run: PlottedRun, file: h5py.File) -> dict[int, str]:
    """Return when each map of a run was saved, and what pressed then, by its index."""
    fields = Fields(file)
    told = ((k, int(fields.steps[k]), float(fields.times[k])) for k in fields.saved)
    return {k: f"{run.instant(step, time)} (step {step})".lstrip() for k, step, time in told}


def read_table(path: Path, names: Sequence[str]) -> dict[str, Array]:
    """Return columns of a table by name; raises InputError where one of those that are needed is missing."""
    columns = {name: np.array(values, dtype=float) for name, values in read_back.read_results(path).items()}
    if missing := [name for name in names if name not in columns]:
        raise InputError(f"{path} has no column {', '.join(missing)}")
    return columns


def find_curve_job(directory: Path) -> Job | None:
    """Return the job of the friction curve in a directory, None where no job is left there."""
    found = (directory / name for name in (STEADY_RESOLVED, RESOLVED))
    return next((shown_job(path) for path in found if path.is_file()), None)


def find_free_area(directory: Path) -> float:
    """Return the area [m^2] of the box of a free scene whose friction curve is in a directory; 0 of any other scene."""
    job = find_curve_job(directory)
    return job.grid.lx * job.grid.ly if job and job.grid.boundary == "free" else 0.0


def to_load(pressure: Array, area: float) -> tuple[Axis, Array]:
    """Return what presses: the force on the box of a free scene of this area, else the mean pressure."""
    return (Axis("force", "N"), pressure * area) if area else (Axis("pressure", "Pa"), pressure)


def to_contact_area(fraction: Array, area: float) -> tuple[Axis, Array]:
    """Return the contact area of a free scene, whose box has this area, else its fraction of the nominal one."""
    return (Axis("contact area", "m²"), fraction * area) if area else (Axis(FRACTION), fraction)
