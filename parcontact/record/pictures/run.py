"""What a picture of a run is drawn from, and in which units."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from pydantic import ValidationError

from ...errors import InputError
from ...job import Job, yamltext
from ...job.timeline import Timeline
from ...parallel.slab import Array
from .. import hdf5, measures

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
Panel = Callable[[Axes], None]


class Run:
    """A run's job and rows. The rows before the first load of a body at rest are left out: nothing has happened yet."""

    def __init__(self, directory: Path) -> None:
        self.directory, self.job = directory, _job(directory / "job.resolved.yaml")
        self._columns = {name: np.array(values) for name, values in measures.read(directory / "measures.csv").items()}
        if not self._columns["step"].size:
            raise InputError(f"{directory} holds no step yet")
        self._first = 1 if self._columns["pressure"][0] == 0.0 and self._columns["step"].size > 1 else 0

    def column(self, name: str) -> Array:
        return self._columns[name][self._first :]

    @property
    def area(self) -> float:
        """Of the box [m^2]."""
        return self.job.grid.lx * self.job.grid.ly

    @property
    def free(self) -> bool:
        return self.job.grid.boundary == "free"

    @property
    def load(self) -> tuple[str, str, Array]:
        """What presses: its name, unit and values."""
        pressure = self.column("pressure")
        return ("force", "N", pressure * self.area) if self.free else ("pressure", "Pa", pressure)

    @cached_property
    def timeline(self) -> Timeline:
        """What the job says about each step."""
        last = float(self._columns["time"][-1])
        return self.job.timeline(last)

    @property
    def stages(self) -> NDArray[np.int64]:
        """The stage of every row; the initial state belongs to the first."""
        return np.array([self.timeline.span(int(n)).index if n else 0 for n in self.column("step")])

    @property
    def lasts(self) -> bool:
        return self._columns["time"][-1] > 0.0

    @property
    def curves(self) -> bool:
        """Whether there is anything to draw over time or load: a single solve is a few numbers."""
        return self.lasts or len(set(self.column("pressure"))) > 1

    @property
    def slides(self) -> bool:
        return self._columns["distance"][-1] > 0.0


class Fields:
    """The saved maps of a run."""

    def __init__(self, file: h5py.File) -> None:
        self.file = file
        self.steps: NDArray[np.int64] = file["step"][...]
        self.x, self.y = file["x"][...], file["y"][...]
        self.saved = [k for k, t in enumerate(file["t"][...]) if not np.isnan(t)]

    def last(self, name: str) -> Array | None:
        """The newest map of a name, if it was saved."""
        field = self.file[name][self.saved[-1]] if name in self.file and self.saved else None
        return field if field is not None and np.isfinite(field).all() else None


def _job(path: Path) -> Job:
    """The resolved job; its files of heights need not be there any more."""
    try:
        data = yamltext.parse(path.read_bytes(), str(path)).data
        data["surface"] = [{"shape": "flat"} if shape["shape"] == "file" else shape for shape in data["surface"]]
        return Job.model_validate(data)
    except (OSError, KeyError, TypeError, ValidationError) as error:
        raise InputError(f"{path} cannot be read: {hdf5.reason(error)}") from error


def scaled(unit: str, *series: Array) -> tuple[str, list[Array]]:
    """The unit with the prefix that suits the largest value, and the series in it."""
    largest = max((float(np.abs(values[np.isfinite(values)]).max(initial=0.0)) for values in series), default=0.0)
    power = 3 * int(np.floor((np.log10(largest) + 1e-9) / 3)) if largest > 0.0 else 0
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    return PREFIXES[power] + unit, [values / 10.0**power for values in series]


def size_of(label: str, unit: str) -> float:
    """What a unit with its prefix stands for."""
    return 10.0 ** next(power for power, prefix in PREFIXES.items() if prefix + unit == label)
