"""Maps of runs and curves in files.

fields.h5: saved maps; and fields.xdmf, by which ParaView reads them.

The file is laid out for all instants before the first one is saved. Saving an instant writes its maps and then its
time, so a killed run leaves a readable file. Instants that were not reached have the time NaN.

steady.h5: maps of steady states, one per solved point of a friction curve.
"""

import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from ..columns import FIELDS
from ..errors import InputError
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab
from . import files, hdf5
from .provenance import Provenance

COORDINATES = ("t", "y", "x", "step")
UNITS = {column.name: column.unit for column in FIELDS if column.name not in COORDINATES}  # of maps
KIND = "parcontact fields"
XDMF_SECONDS = 10.0  # tuning: least time between updates of fields.xdmf, which grows with every instant [s]


class FieldsFile:
    """Saved maps of shape (t, y, x), with coordinates; all methods are collective.

    Parameters: path; this rank's rows; `size` of the box (lx, ly) [m]; names of maps; `steps` after which they are
    saved.
    """

    def __init__(
        self, path: Path, slab: Slab, size: tuple[float, float], names: Sequence[str], steps: Sequence[int]
    ) -> None:
        self.path, self.slab, self.size, self.names = path, slab, size, tuple(names)
        self.steps = {step: index for index, step in enumerate(steps)}
        self.trouble = ""  # failure to write fields.xdmf, which does not end a run; root only
        self.provenance = Provenance(())
        self._drawn = 0.0
        self._kept: frozenset[int] = frozenset()

    def make(self, provenance: Provenance) -> None:
        """Create the file; an existing one is replaced."""
        self.provenance = provenance
        self._replace(None)

    def make_place(self, steps: Sequence[int]) -> None:
        """Lay the file out for other future steps; saved maps are kept."""
        found, _ = _found(self.path, self.slab)
        if found is not None:
            kept = found.reached(max(found.steps, default=0))
            self.steps = {step: index for index, step in enumerate(sorted({*kept, *steps}))}
            self._replace(found, kept)

    def resume(self, step: int, provenance: Provenance) -> str:
        """Continue after a step: maps saved up to it are kept, even if other maps were requested then.

        Returns a message about lost maps, or ''; an unreadable file is renamed. Raises InputError for a locked file.
        """
        self.provenance = provenance
        found, problem = _found(self.path, self.slab)
        kept = found.reached(step) if found else []
        self.steps = {n: i for i, n in enumerate(sorted({*kept, *(n for n in self.steps if n >= step)}))}
        self._kept = frozenset(kept)
        if found and found.steps == tuple(self.steps) and set(found.names) == set(self.names):
            hdf5.change(self.path, self.slab, provenance.renew)
            hdf5.set_marks(self.path, self.slab, slice(len(kept), None), {"t": np.nan})
            self._draw()
        else:
            self._replace(found, kept)
        return problem

    def is_due(self, step: int) -> bool:
        """Return True if the maps of the step from which a run continues are due but not saved."""
        return step in self.steps and step not in self._kept

    def renew(self, provenance: Provenance) -> None:
        """Update the provenance in the file."""
        self.provenance = provenance
        hdf5.change(self.path, self.slab, provenance.renew)

    def save(self, step: int, time: float, maps: Mapping[str, Array]) -> None:
        hdf5.save_maps(self.path, self.slab, self.steps[step], {name: maps[name] for name in self.names}, {"t": time})
        if self.slab.agree(clock.monotonic() - self._drawn > XDMF_SECONDS):
            self._draw()

    def sync(self, provenance: Provenance) -> None:
        """Flush all saved maps and the provenance to disk, and update fields.xdmf. Raises RunError."""
        self.renew(provenance)
        hdf5.sync(self.path, self.slab)
        self._draw()

    def _build(self, file: h5py.File) -> None:
        file.attrs["kind"] = KIND
        self.provenance.write(file)
        hdf5.add_coordinate(file, "t", np.full(len(self.steps), np.nan), "s")
        step = hdf5.fixed(file, "step", (len(self.steps),), np.int64)
        step[...] = list(self.steps)
        step.dims[0].attach_scale(file["t"])
        hdf5.add_maps(file, self.slab, self.size, {name: UNITS[name] for name in self.names}, "t")

    def _replace(self, found: "SavedFields | None", kept: Sequence[int] = ()) -> None:
        """Create a new file with copies of the maps of the steps `kept`; maps that were not saved are NaN."""
        new = self.slab.agree(files.unused(self.path))
        size = len(self.steps) * len(self.names) * self.slab.nx * self.slab.ny * hdf5.DOUBLE
        hdf5.lay_out(new, self.slab, self._build, size)
        if found:
            self._copy(found, kept, new)
        hdf5.write_on_root(self.slab, lambda: new.replace(self.path), f"cannot write {self.path}")
        self._draw()

    def _copy(self, found: "SavedFields", kept: Sequence[int], new: Path) -> None:
        rows = np.empty(self.slab.shape)
        for step in kept:
            for name in self.names:
                rows.fill(np.nan)
                if name in found.names:
                    hdf5.read_rows(self.path, self.slab, [hdf5.Slice(name, (found.steps.index(step),), rows)])
                hdf5.write_rows(new, self.slab, [hdf5.Slice(name, (self.steps[step],), rows)])
        times = [found.times[found.steps.index(step)] for step in kept]
        hdf5.set_marks(new, self.slab, [self.steps[step] for step in kept], {"t": times})
        hdf5.sync(new, self.slab)

    def _draw(self) -> None:
        target = self.path.with_suffix(".xdmf")
        if self.slab.root:
            try:
                with h5py.File(self.path, "r", locking=False) as file:
                    times, steps = file["t"][...], file["step"][...]
                points = (self.slab.ny, self.slab.nx)
                files.replace_file(target, xdmf(self.path.name, times, steps, points, self.size, self.names))
                self.trouble = ""
            except hdf5.FAILURES as error:
                self.trouble = f"cannot write {target}: {hdf5.reason(error)}"
        self._drawn = clock.monotonic()


def cut_back(path: Path, slab: Slab, step: int) -> str:
    """Mark the instants after a step as not reached, in a file that is not continued; collective.

    Returns a message about lost maps; raises InputError as `FieldsFile.resume`.
    """
    if not slab.agree(path.exists()):
        return ""
    found, problem = _found(path, slab)
    if found:
        hdf5.set_marks(path, slab, np.array(found.steps) > step, {"t": np.nan})
    return problem


class SavedFields:
    """The maps and instants in a field file; raises ValueError if their numbers differ."""

    def __init__(self, file: h5py.File) -> None:
        self.names = tuple(name for name in UNITS if name in file)
        self.steps: tuple[int, ...] = tuple(file["step"][...].tolist())
        self.times: NDArray[np.float64] = file["t"][...]
        self.saved: list[int] = np.flatnonzero(~np.isnan(self.times)).tolist()
        instants, places = (len(self.steps),), (len(file["y"]), len(file["x"]))
        for name, shape in {"t": instants, **dict.fromkeys(self.names, instants + places)}.items():
            if file[name].shape != shape:
                raise ValueError(f"{name} has shape {file[name].shape}")

    def reached(self, step: int) -> list[int]:
        """Return the steps up to a step that have saved maps."""
        return [self.steps[index] for index in self.saved if self.steps[index] <= step]


def _found(path: Path, slab: Slab) -> tuple[SavedFields | None, str]:
    """Return the contents of a field file, and a message about lost maps; collective.

    An unreadable file is renamed. Raises InputError for a locked file.
    """

    def look() -> tuple[SavedFields | None, str]:
        if not path.exists():
            return None, f"{path} is missing: the fields saved so far are lost"
        try:
            with h5py.File(path, "r") as file:
                return SavedFields(file), ""
        except BlockingIOError:
            raise InputError(f"{path} is locked by another program; let it close the file, and run again") from None
        except hdf5.FAILURES as error:
            kept = files.put_aside(path)
            return None, f"{path} cannot be read ({hdf5.reason(error)}): it is kept as {kept}, and a new file is begun"

    return on_root(slab.comm, look)


def xdmf(
    file: str, times: Array, steps: Array, shape: tuple[int, int], size: tuple[float, float], names: tuple[str, ...]
) -> str:
    """Return the XDMF text of the saved instants: maps of one layer of points in the plane z = 0.

    XDMF orders axes z, y, x with x fastest. ParaView puts two-dimensional meshes into the y-z plane, so a
    three-dimensional mesh of one layer is used. Readers show one map per time: if instants have equal times, as loads
    without duration do, step numbers are used as times.
    """
    (ny, nx), (lx, ly) = shape, size
    saved = np.flatnonzero(~np.isnan(times))
    shown = times if len(set(times[saved].tolist())) == saved.size else steps.astype(np.float64)
    real = 'NumberType="Float" Precision="8"'
    grids = []
    for index in saved:
        attributes = "".join(
            f'<Attribute Name="{name}" Center="Node"><DataItem ItemType="HyperSlab" Dimensions="1 {ny} {nx}">'
            f'<DataItem Dimensions="3 3" Format="XML">{index} 0 0 1 1 1 1 {ny} {nx}</DataItem>'
            f'<DataItem Dimensions="{len(times)} {ny} {nx}" {real} Format="HDF">'
            f"{file}:/{name}</DataItem></DataItem></Attribute>"
            for name in names
        )
        spacing = f"{lx / nx!r} {ly / ny!r} {lx / nx!r}"  # the same in the order of x, y, z and of z, y, x
        grids.append(
            f'<Grid><Time Value="{float(shown[index])!r}"/><Topology TopologyType="3DCoRectMesh" '
            f'Dimensions="1 {ny} {nx}"/><Geometry GeometryType="ORIGIN_DXDYDZ">'
            f'<DataItem Dimensions="3" {real} Format="XML">0 0 0</DataItem>'
            f'<DataItem Dimensions="3" {real} Format="XML">{spacing}</DataItem></Geometry>{attributes}</Grid>'
        )
    return (
        '<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid GridType="Collection" CollectionType="Temporal">'
        + "\n".join(grids)
        + "</Grid></Domain></Xdmf>\n"
    )


KIND_OF_STEADY_MAPS = "parcontact steady maps"
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
        file.attrs["kind"] = KIND_OF_STEADY_MAPS
        provenance.write(file)
        for name, unit in self.axes.items():
            hdf5.add_coordinate(file, name, np.full(len(self.points), np.nan), unit)
        units = {DATASETS[name]: UNITS[name] for name in self.names}
        hdf5.add_maps(file, self.slab, self.size, units, list(self.axes))
