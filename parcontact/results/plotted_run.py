"""Results of a run, for pictures and reports: rows, stages, and saved maps."""

from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from .. import printed
from ..errors import InputError
from ..files import outputs
from ..files.fields import SavedMaps
from ..files.hdf5 import MEND
from ..job import Job
from ..job.history import Timeline
from ..job.reading import shown_job
from ..parallel.slab import Array
from .panels import Axis
from .results import Results

FRACTION = "contact area /\nnominal area"
MEASURED = (
    *("step", "time", "distance", "pressure", "friction", "friction_x", "contact_area", "contact_area_corrected"),
    *("approach", "mean_gap", "max_pressure", "work", "stored", "dissipated"),
)
DIGITS = 6  # significant digits of values that count as equal
NEAREST = 3  # number of nearest steps with maps in a message


class PlottedRun(Results):
    """The job and the rows of a run for pictures, without the unloaded rows at the beginning."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory, "run")
        self.area = self.job.grid.lx * self.job.grid.ly  # of the box [m^2]
        self.free = self.job.grid.boundary == "free"
        self._all = self.table.arrays(MEASURED)
        if not self._all["step"].size:
            raise InputError(f"{directory} has no step yet")
        first = int(self._all["pressure"][0] == 0.0 and self._all["step"].size > 1)
        self.columns = {name: values[first:] for name, values in self._all.items()}
        self.lasts, self.slides = self._all["time"][-1] > 0.0, self._all["distance"][-1] > 0.0

    @cached_property
    def job(self) -> Job:
        """Job of the run."""
        return shown_job(self.path / outputs.RUN.resolved)

    @property
    def load(self) -> tuple[Axis, Array]:
        return to_load(self.columns["pressure"], self.area * self.free)

    @property
    def in_contact(self) -> tuple[Axis, Array]:
        """Return the axis and the values of the contact area, corrected for cells at its edges."""
        return to_contact_area(self.columns["contact_area_corrected"], self.area * self.free)

    @property
    def backwards(self) -> bool:
        """Return True if the surface moves along x only and reverses; the magnitude of friction would then have a
        cusp."""
        velocities = [stage.velocity for stage in self.job.history]
        turns = any(stage.speed and not stage.slides for stage in self.job.history)
        return (turns or any(x < 0.0 for x, _ in velocities)) and not any(y for _, y in velocities)

    @property
    def curves(self) -> bool:
        """Return True if there is more than one solve, so that curves can be drawn."""
        return bool(self.lasts) or len(set(self.columns["pressure"])) > 1

    @cached_property
    def timeline(self) -> Timeline:
        """Return the timeline of the run, which states the stage of each step."""
        steps, times = self._all["step"].astype(int).tolist(), self._all["time"].tolist()
        return Timeline.from_job(self.job, times[-1]).follow(dict(zip(steps, times, strict=True)))

    @property
    def telling_step(self) -> int:
        """Return the step whose maps show the contact best: the last one, or after a detachment the step of the
        pull-off or of the largest load."""
        return int(self._all["step"][self.telling_row])

    @property
    def rows_of_stages(self) -> dict[int, list[int]]:
        """Return the row numbers of each stage, by its index; the initial state belongs to the first stage."""
        found: dict[int, list[int]] = {}
        for row, step in enumerate(self.columns["step"].astype(int).tolist()):
            if (stage := self._stage(step)) >= 0:
                found.setdefault(stage, []).append(row)
        return found

    def _stage(self, step: int) -> int:
        """Return the stage of a step, -1 if the job does not have this step."""
        step = max(step, 1)
        return self.timeline.span(step).index if step <= len(self.timeline) else -1

    def instant(self, step: int, time: float) -> str:
        """Return time and load of a saved map as text: `2.1 ms, 100 kPa`, `150 mN`, `2.1 ms, approach 20 µm`."""
        when = printed.quantity(time, "s", 4) if self.lasts else ""
        return ", ".join(filter(None, (when, self.pressed(step))))

    def pressed(self, step: int) -> str:
        """Return the load after a step as text, in the quantity that its stage prescribes; '' without a row."""
        rows, stage = np.flatnonzero(self._all["step"] == step), self._stage(step)
        if not rows.size:
            return ""
        if stage >= 0 and self.job.history[stage].control == "approach":
            return f"approach {printed.quantity(self._all['approach'][rows[-1]], 'm')}"
        axis, loads = to_load(self._all["pressure"], self.area * self.free)
        return printed.quantity(loads[rows[-1]], axis.unit)

    def name_stage(self, step: int) -> str:
        """Return the name of the stage of a step; '' if it has none."""
        stage = self._stage(step)
        name = self.job.history[stage].name if stage >= 0 else ""
        return "" if name == f"stage {stage + 1}" else name

    def moved(self, step: int) -> tuple[float, float]:
        """Return the position of the surface after a step [m]; the initial position for a step that the job lacks."""
        return self.timeline[step].position if 1 <= step <= len(self.timeline) else (0.0, 0.0)


class Fields(SavedMaps):
    """The saved maps of a run: `shown` are the instants to draw, `chosen` is the one whose maps are drawn (default: the
    last).

    `at` is a step (a whole number), whose maps must be saved, or a time [s], for which the nearest maps are taken.
    """

    def __init__(self, file: h5py.File, at: str = "", until: int | None = None) -> None:
        try:
            super().__init__(file)
        except ValueError as error:
            raise InputError(f"{file.filename} is damaged: {error}; {MEND}") from error
        self.file, self.x, self.y = file, file["x"][...], file["y"][...]
        self.shown = [self._index(at)] if at else self.saved
        before = [k for k in self.shown if until is None or self.steps[k] <= until]
        self.chosen = (before or self.shown or [-1])[-1]

    def when(self, index: int) -> tuple[int, float]:
        """Return step and time [s] of a saved instant."""
        return self.steps[index], float(self.times[index])

    def read(self, name: str) -> Array | None:
        """Return the named map at the chosen instant, or None."""
        field = self.file[name][self.chosen] if name in self.file and self.shown else None
        return field if field is not None and np.isfinite(field).all() else None

    def _index(self, at: str) -> int:
        """Return the index of the instant `at`; raises InputError if no map is saved then."""
        if not self.saved:
            raise InputError(f"--at {at}: no map is saved yet")
        steps, times = np.array(self.steps)[self.saved], self.times[self.saved]
        if not at.isdecimal() and not times[0] <= float(at) <= times[-1]:
            raise InputError(f"--at {at}: maps are saved from {times[0]:g} to {times[-1]:g} s")
        order = np.argsort(np.abs(steps - int(at) if at.isdecimal() else times - float(at)), kind="stable")
        if at.isdecimal() and int(at) not in steps:
            near = ", ".join(map(str, sorted(steps[order[:NEAREST]])))
            raise InputError(f"--at {at}: no map is saved after step {at}; the nearest steps with maps are {near}")
        return int(self.saved[order[0]])


def choose_evenly(labels: dict[int, str], most: int) -> dict[int, str]:
    """Return at most `most` of the labelled instants, evenly spaced, including the first and the last."""
    indices = list(labels)
    kept = np.linspace(0, len(indices) - 1, min(len(indices), most)).astype(int)
    return {indices[k]: labels[indices[k]] for k in kept}


def label_frames(run: PlottedRun, file: h5py.File) -> dict[int, str]:
    """Return time and load of each map of a run as text, by its index."""
    fields = Fields(file)
    return {k: f"{run.instant(*fields.when(k))} (step {fields.steps[k]})".lstrip() for k in fields.saved}


def round_digits(values: Array) -> Array:
    """Return values rounded to DIGITS digits, so that values that differ only by rounding become equal."""
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])


def count_different(values: Array) -> int:
    """Return the number of values that differ by more than rounding."""
    return np.unique(round_digits(values)).size


def to_load(pressure: Array, area: float) -> tuple[Axis, Array]:
    """Return axis and values of the load: the force on a free box of this `area` [m^2], else the mean pressure."""
    return (Axis("force", "N"), pressure * area) if area else (Axis("pressure", "Pa"), pressure)


def to_contact_area(fraction: Array, area: float) -> tuple[Axis, Array]:
    """Return axis and values of the contact: its area for a free box of this `area` [m^2], else its nominal share."""
    return (Axis("contact area", "m²"), fraction * area) if area else (Axis(FRACTION), fraction)
