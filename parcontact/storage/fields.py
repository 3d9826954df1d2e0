"""fields.h5: saved maps, and fields.xdmf, through which ParaView reads them.

The file is laid out for all instants of the run before the first: saving one writes numbers into their places and its
time last, so that a run that dies leaves a readable file. Instants not reached yet have the time NaN.
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

MAPS = ("pressure", "displacement", "gap", "height", "temperature", "traction_x", "traction_y")
UNITS = {column.name: column.unit for column in FIELDS if column.name in MAPS}
KIND = "parcontact fields"
XDMF_SECONDS = 10.0  # tuning: at least between two versions of fields.xdmf, which grows with every instant


class FieldsFile:
    """Saved maps of shape (t, y, x), with coordinates; every method is collective.

    Parameters: where; this rank's rows; the box `size` (lx, ly) [m]; which maps; after which `steps` they are saved.
    """

    def __init__(
        self, path: Path, slab: Slab, size: tuple[float, float], names: Sequence[str], steps: Sequence[int]
    ) -> None:
        self.path, self.slab, self.size, self.names = path, slab, size, tuple(names)
        self.steps = {step: index for index, step in enumerate(steps)}
        self.trouble = ""  # with fields.xdmf, which no run ends for; on root
        self.provenance = Provenance(())
        self._drawn = 0.0
        self._kept: frozenset[int] = frozenset()

    def make(self, provenance: Provenance) -> None:
        """Lay the file out anew; what has its name is replaced."""
        self.provenance = provenance
        self._replace(None)

    def make_place(self, steps: Sequence[int]) -> None:
        """Lay the file out for other steps to come than were foreseen; what was saved stays, and no more place."""
        found, _ = _found(self.path, self.slab)
        if found is not None:
            kept = found.reached(max(found.steps, default=0))
            self.steps = {step: index for index, step in enumerate(sorted({*kept, *steps}))}
            self._replace(found, kept)

    def resume(self, step: int, provenance: Provenance) -> str:
        """Go on after a step: what was saved up to it stays, whatever else was asked for then.

        Returns what is lost, or ''; a file that cannot be read is put aside. Raises InputError for one that is locked.
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
        """Return whether the maps of the step after which a run goes on are due, and were not saved then."""
        return step in self.steps and step not in self._kept

    def renew(self, provenance: Provenance) -> None:
        """Put what has changed of its origin into the file."""
        self.provenance = provenance
        hdf5.change(self.path, self.slab, provenance.renew)

    def save(self, step: int, time: float, maps: Mapping[str, Array]) -> None:
        hdf5.save_maps(self.path, self.slab, self.steps[step], {name: maps[name] for name in self.names}, {"t": time})
        if self.slab.agree(clock.monotonic() - self._drawn > XDMF_SECONDS):
            self._draw()

    def sync(self, provenance: Provenance) -> None:
        """Wait until all that was saved is on the disk, with what is new of its origin; bring fields.xdmf up to date.

        Raises RunError.
        """
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
        """Lay a new file out, and copy the maps of the steps that are `kept`; one that was not saved then is NaN."""
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
    """Take the instants after a step as not reached, in a file to which nothing more is added; collective.

    As for `FieldsFile.resume`, returns what is lost, and raises InputError.
    """
    if not slab.agree(path.exists()):
        return ""
    found, problem = _found(path, slab)
    if found:
        hdf5.set_marks(path, slab, np.array(found.steps) > step, {"t": np.nan})
    return problem


class SavedFields:
    """The maps and instants of a file of fields."""

    def __init__(self, file: h5py.File) -> None:
        self.names = tuple(name for name in UNITS if name in file)
        self.steps: tuple[int, ...] = tuple(file["step"][...].tolist())
        self.times: NDArray[np.float64] = file["t"][...]
        for name in self.names:
            if file[name].shape != (len(self.steps), len(file["y"]), len(file["x"])):
                raise ValueError(f"{name} has shape {file[name].shape}")

    def reached(self, step: int) -> list[int]:
        """Return the instants that were saved, up to a step."""
        pairs = zip(self.steps, self.times, strict=True)
        return [number for number, time in pairs if number <= step and not np.isnan(time)]


def _found(path: Path, slab: Slab) -> tuple[SavedFields | None, str]:
    """Return what a file of fields holds, and what is lost; collective. Raises InputError for one that is locked.

    A file that cannot be read is put aside.
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
    """Return the XDMF text that describes the saved instants: maps of one layer of points in the plane z = 0.

    XDMF counts z, y, x, the fastest last. Of a mesh of two dimensions ParaView's reader takes the first for z, which
    puts it into the y-z plane; a mesh of three with one layer has no such choice. Readers show one map per time: where
    several instants have the same one, as those of loads without duration, the numbers of the steps stand for times.
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
