"""Growing files of maps.

The file fields.h5 has the maps of a run over time; ParaView reads it by fields.xdmf. The file steady.h5 has the maps of
the points of a friction curve.
"""

import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np

from ..columns import FIELDS
from ..errors import InputError
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab
from . import files, hdf5, tables
from .hdf5 import Provenance

COORDINATES = ("t", "y", "x", "step")
UNITS = {column.name: column.unit for column in FIELDS if column.name not in COORDINATES}  # of maps
KIND, KIND_OF_STEADY_MAPS = "parcontact fields", "parcontact steady maps"
AXES = {"velocity": "m/s", "load": "Pa", "temperature": "deg C"}  # coordinates of points; load: mean pressure
DATASETS = {name: f"{name}_map" if name in AXES else name for name in UNITS}  # data set of each map of points
XDMF_SECONDS = 10.0  # tuning: least time between updates of fields.xdmf, which grows with every instant [s]


class SavedMaps:
    """The maps in a file, one of each kind at each place. Places are the instants of a run, whose step numbers are
    `steps`, or the points of a curve. `marks` maps the name of a coordinate, such as time or velocity, to its values at
    all places. Raises ValueError if datasets have different numbers of places."""

    def __init__(self, file: h5py.File) -> None:
        over_time = "t" in file
        axes = ["t"] if over_time else [name for name in AXES if name in file]
        known = {name: name for name in UNITS} if over_time else DATASETS
        self.datasets = {name: dataset for name, dataset in known.items() if dataset in file}
        self.names = tuple(self.datasets)
        self.steps: tuple[int, ...] = tuple(file["step"][...].tolist()) if over_time else ()
        self.marks: dict[str, Array] = {name: file[name][...] for name in axes}
        first, *_ = self.marks.values()
        self.saved: list[int] = np.flatnonzero(~np.isnan(first)).tolist()
        self.shape = (len(self.steps) if over_time else first.size, len(file["y"]), len(file["x"]))
        wanted = dict.fromkeys(axes, self.shape[:1]) | dict.fromkeys(self.datasets.values(), self.shape)
        for name, shape in wanted.items():
            if file[name].shape != shape:
                raise ValueError(f"{name} has shape {file[name].shape}")

    @property
    def times(self) -> Array:
        """Times of the instants of a run [s], or NaN for an instant without saved maps."""
        return self.marks["t"]

    @property
    def points(self) -> dict[int, tuple[float, ...]]:
        """Saved points of a curve, by their indices."""
        return {index: tuple(float(values[index]) for values in self.marks.values()) for index in self.saved}

    def reached(self, step: int) -> list[int]:
        """Return the numbers of those steps that have saved maps and are not later than `step`."""
        return [self.steps[index] for index in self.saved if self.steps[index] <= step]


class GrowingMaps:
    """A file of maps of shape (place, y, x), whose places are instants of a run or points of a curve. Its space is laid
    out for all places before the first map is saved. Collective.

    To save a place, its maps are written first, and then its coordinates, which are NaN before. So a killed run leaves
    a readable file. `path` is the path of the file, `slab` the rows of this rank, and `size` the size of the box (lx,
    ly) [m]. `axes` maps the names of the coordinates to their units, and `units` the names of the datasets of maps to
    their units.
    """

    def __init__(
        self, path: Path, slab: Slab, size: tuple[float, float], axes: Mapping[str, str], units: Mapping[str, str]
    ) -> None:
        self.path, self.slab, self.size, self.axes, self.units = path, slab, size, axes, units
        self.provenance = Provenance(())

    def replace_file(
        self, kind: str, count: int, found: SavedMaps | None, kept: Mapping[int, int], steps: list[int] | None = None
    ) -> None:
        """Create a new file for `count` instants of a run or points of a curve (places). Collective.

        `kind` is `KIND` or `KIND_OF_STEADY_MAPS`. For a run, `steps` are the step numbers of all its instants, also of
        those that are not reached yet; for a curve, `steps` is None. Places of the present file `found` are copied:
        `kept` maps the new index of such a place to its old index. Maps that were not saved are NaN.
        """

        def build(file: h5py.File) -> None:
            file.attrs["kind"] = kind
            self.provenance.write(file)
            for name, unit in self.axes.items():
                hdf5.add_coordinate(file, name, np.full(count, np.nan), unit)
            if steps is not None:
                step = hdf5.fixed(file, "step", (count,), np.int64)
                step[...] = steps
                step.dims[0].attach_scale(file["t"])
            hdf5.add_maps(file, self.slab, self.size, self.units, list(self.axes))

        new = self.slab.agree(files.unused(self.path))
        hdf5.lay_out(new, self.slab, build, count * len(self.units) * self.slab.nx * self.slab.ny * hdf5.DOUBLE)
        if found:
            self._copy(found, kept, new)
        hdf5.write_on_root(self.slab, lambda: new.replace(self.path), f"cannot write {self.path}")

    def _copy(self, found: SavedMaps, kept: Mapping[int, int], new: Path) -> None:
        rows, there = np.empty(self.slab.shape), found.datasets.values()
        for index, old in kept.items():
            for name in self.units:
                rows.fill(np.nan)
                if name in there:
                    hdf5.read_rows(self.path, self.slab, [hdf5.Slice(name, (old,), rows)])
                hdf5.write_rows(new, self.slab, [hdf5.Slice(name, (index,), rows)])
        marks = {name: values[list(kept.values())] for name, values in found.marks.items()}
        hdf5.set_marks(new, self.slab, list(kept), marks)
        hdf5.sync(new, self.slab)


class SteadyMaps(GrowingMaps):
    """Maps of the points of a friction curve. Collective.

    `path` is the path of the file, `slab` the rows of this rank, `size` the size of the box (lx, ly) [m], and `names`
    are the names of the maps. Each of the `points` is a velocity [m/s], a mean pressure [Pa] and optionally a
    temperature [deg C]. Points that the file already holds are kept; a file with other maps is renamed. The attribute
    `lacking` has the indices of points without maps.
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
        axes = dict(list(AXES.items())[: len(points[0])])
        super().__init__(path, slab, size, axes, {DATASETS[name]: UNITS[name] for name in names})
        self.names, self.points, self.provenance = tuple(names), points, provenance
        found, _ = _found(path, slab)
        wanted = {*names}, [*axes], (slab.ny, slab.nx)
        if found and ({*found.names}, [*found.marks], found.shape[1:]) != wanted:
            hdf5.write_on_root(slab, lambda: files.put_aside(path), f"cannot rename {path}")
            found = None
        saved = found.points if found else {}
        others = [point for point in saved.values() if tables.lacking_points([point], points)]
        there = [
            next((row for row, other in saved.items() if tables.is_same(point, other)), None)
            for point in (*points, *others)
        ]
        self.lacking = [index for index in range(len(points)) if there[index] is None]
        if found is None or found.shape[0] != len(there):
            kept = {index: row for index, row in enumerate(there) if row is not None}
            self.replace_file(KIND_OF_STEADY_MAPS, len(there), found, kept)
            self._rows = list(range(len(there)))
        else:
            free = iter([row for row in range(len(there)) if row not in saved])
            self._rows = [next(free) if row is None else row for row in there]

    def save(self, index: int, maps: Mapping[str, Array]) -> None:
        """Save the maps of a point. Raises RunError."""
        marks = dict(zip(self.axes, self.points[index], strict=True))
        named = {DATASETS[name]: maps[name] for name in self.names}
        hdf5.save_maps(self.path, self.slab, self._rows[index], named, marks)


class FieldsFile(GrowingMaps):
    """Saved maps of a run over time; all methods are collective.

    `path` is the path of the file, `slab` the rows of this rank, `size` the size of the box (lx, ly) [m], and `names`
    are the names of the maps. Maps are saved after each of the `steps`.
    """

    def __init__(
        self, path: Path, slab: Slab, size: tuple[float, float], names: Sequence[str], steps: Sequence[int]
    ) -> None:
        super().__init__(path, slab, size, {"t": "s"}, {name: UNITS[name] for name in names})
        self.names = tuple(names)
        self.steps = {step: index for index, step in enumerate(steps)}
        self.trouble = ""  # failure to write fields.xdmf, which does not end a run; root only
        self._drawn = 0.0
        self._kept: frozenset[int] = frozenset()

    def make(self, provenance: Provenance) -> None:
        """Create the file. An existing file is replaced."""
        self.provenance = provenance
        self._replace(None)

    def make_place(self, steps: Sequence[int]) -> None:
        """Lay out the file for the maps that are already saved, which are kept, and for maps after the given `steps`.
        Places for other maps are removed."""
        found, _ = _found(self.path, self.slab)
        if found is not None:
            kept = found.reached(max(found.steps, default=0))
            self.steps = {step: index for index, step in enumerate(sorted({*kept, *steps}))}
            self._replace(found, kept)

    def resume(self, step: int, provenance: Provenance) -> str:
        """Prepare the file of a run that continues after a step. Maps saved up to this step are kept, even if the
        present job would not save them.

        Return a message about lost maps, or ''. An unreadable file is renamed. Raises InputError for a locked file.
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
        """Return True if the job asks for the maps of `step`, from which a run continues, and they are not saved."""
        return step in self.steps and step not in self._kept

    def renew(self, provenance: Provenance) -> None:
        """Update the provenance in the file."""
        self.provenance = provenance
        hdf5.change(self.path, self.slab, provenance.renew)

    def save(self, step: int, time: float, maps: Mapping[str, Array]) -> None:
        named = {name: maps[name] for name in self.names}
        hdf5.save_maps(self.path, self.slab, self.steps[step], named, {"t": time})
        if self.slab.agree(clock.monotonic() - self._drawn > XDMF_SECONDS):
            self._draw()

    def sync(self, provenance: Provenance) -> None:
        """Flush all saved maps and the provenance to disk, and update fields.xdmf. Raises RunError."""
        self.renew(provenance)
        hdf5.sync(self.path, self.slab)
        self._draw()

    def _replace(self, found: SavedMaps | None, kept: Sequence[int] = ()) -> None:
        """Create a new file with copies of the maps of the steps `kept`."""
        rows = {self.steps[step]: found.steps.index(step) for step in kept} if found else {}
        self.replace_file(KIND, len(self.steps), found, rows, list(self.steps))
        self._draw()

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
                self.trouble = f"cannot write {target}: {files.reason(error)}"
        self._drawn = clock.monotonic()


def cut_back(path: Path, slab: Slab, step: int) -> str:
    """Mark all instants after a step as not reached, in the file of a run that saves no more maps. Collective.

    Return a message about lost maps, or ''. Raises InputError for a locked file.
    """
    if not slab.agree(path.exists()):
        return ""
    found, problem = _found(path, slab)
    if found:
        hdf5.set_marks(path, slab, np.array(found.steps) > step, {"t": np.nan})
    return problem


def _found(path: Path, slab: Slab) -> tuple[SavedMaps | None, str]:
    """Return the contents of a field file, and a message about lost maps. Collective.

    An unreadable file is renamed. Raises InputError for a locked file.
    """

    def look() -> tuple[SavedMaps | None, str]:
        if not path.exists():
            return None, f"{path} is missing: the fields saved so far are lost"
        try:
            with h5py.File(path, "r") as file:
                return SavedMaps(file), ""
        except BlockingIOError:
            raise InputError(f"{path} is locked by another program; let it close the file, and run again") from None
        except hdf5.FAILURES as error:
            kept = files.put_aside(path)
            return None, f"{path} cannot be read ({files.reason(error)}): it is kept as {kept}, and a new file is begun"

    return on_root(slab.comm, look)


def xdmf(
    file: str, times: Array, steps: Array, shape: tuple[int, int], size: tuple[float, float], names: tuple[str, ...]
) -> str:
    """Return the XDMF text of the saved instants: maps of one sheet of points in the plane z = 0.

    XDMF orders axes z, y, x with x fastest. ParaView puts two-dimensional meshes into the y-z plane, so a
    three-dimensional mesh of one sheet is used. Readers show one map per time: if instants have equal times, as loads
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
