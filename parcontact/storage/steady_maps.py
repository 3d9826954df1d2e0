"""steady.h5: maps of steady states, one per solved point of a friction curve."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np

from ..parallel.slab import Array, Slab
from . import files, hdf5
from .fields import UNITS
from .provenance import Provenance

KIND = "parcontact steady maps"
AXES = {"velocity": "m/s", "load": "Pa", "temperature": "deg C"}  # coordinates of points; load: mean pressure
DATASETS = {name: f"{name}_map" if name in AXES else name for name in UNITS}  # data set of each kind of map


class SteadyMaps:
    """Maps of shape (point, y, x), with velocity and load of each point, NaN until it is saved; collective.

    Parameters: path; this rank's rows; `size` of the box (lx, ly) [m]; names of maps; (velocity [m/s], mean pressure
    [Pa], optionally temperature [deg C]) of all points. Points saved by an earlier part of the curve are kept.
    """

    def __init__(
        self,
        path: Path,
        slab: Slab,
        size: tuple[float, float],
        names: Sequence[str],
        points: Sequence[tuple[float, ...]],
        provenance: Provenance,
    ) -> None:
        self.path, self.slab, self.size, self.names, self.points = path, slab, size, tuple(names), list(points)
        self.axes = dict(list(AXES.items())[: len(self.points[0])])
        if not slab.agree(slab.root and self._fits()):
            self._make(provenance)

    def save(self, index: int, maps: Mapping[str, Array]) -> None:
        """Save the maps of a point; raises RunError."""
        marks = dict(zip(self.axes, self.points[index], strict=True))
        hdf5.save_maps(self.path, self.slab, index, {DATASETS[name]: maps[name] for name in self.names}, marks)

    def lacking(self) -> list[int]:
        """Return the indices of points without maps; root only."""
        with h5py.File(self.path, "r") as file:
            return [number for number, speed in enumerate(file["velocity"][...]) if np.isnan(speed)]

    def _fits(self) -> bool:
        """Return True if the file has these points and maps; another file is renamed. Root only."""
        shape = (len(self.points), self.slab.ny, self.slab.nx)
        try:
            with h5py.File(self.path, "r") as file:
                wanted = {name for name, dataset in DATASETS.items() if dataset in file} == set(self.names)
                if wanted and all(file[DATASETS[name]].shape == shape for name in self.names):
                    saved = np.array([file[name][...] for name in self.axes]).T
                    return bool(np.all(np.isnan(saved) | np.isclose(saved, self.points, rtol=1e-6)))
        except hdf5.FAILURES:
            pass
        files.put_aside(self.path)
        return False

    def _make(self, provenance: Provenance) -> None:
        new = self.slab.agree(files.unused(self.path))
        size = len(self.points) * len(self.names) * self.slab.nx * self.slab.ny * hdf5.DOUBLE
        hdf5.lay_out(new, self.slab, lambda file: self._build(file, provenance), size)
        hdf5.write_on_root(self.slab, lambda: new.replace(self.path), f"cannot write {self.path}")

    def _build(self, file: h5py.File, provenance: Provenance) -> None:
        file.attrs["kind"] = KIND
        provenance.write(file)
        for name, unit in self.axes.items():
            hdf5.add_coordinate(file, name, np.full(len(self.points), np.nan), unit)
        units = {DATASETS[name]: UNITS[name] for name in self.names}
        hdf5.add_maps(file, self.slab, self.size, units, list(self.axes))
