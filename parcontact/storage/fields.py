"""fields.h5: saved maps, and fields.xdmf, through which ParaView reads them.

The file is laid out for all instants of the run before the first: saving one writes numbers into their places and its
time last, so that a run that dies leaves a readable file. Instants not reached yet have the time NaN.
"""

import os
import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path
from stat import S_ISREG

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..parallel.slab import Array, Slab
from . import files, hdf5, layout
from .provenance import Provenance

UNITS = {"pressure": "Pa", "displacement": "m", "gap": "m", "height": "m"}
KIND = "parcontact fields"
XDMF_SECONDS = 10.0  # at least between two versions of fields.xdmf, which grows with every instant


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
        self._drawn = 0.0
        self._identity = (0, 0)
        self._kept: frozenset[int] = frozenset()
        self._provenance: Provenance | None = None

    def make(self, provenance: Provenance) -> None:
        """Lay the file out anew; what has its name is replaced."""
        self._provenance = provenance
        new = self.slab.agree(files.unused(self.path))
        layout.lay_out(new, self.slab, lambda file: self._build(file, provenance))
        self._publish(new)

    def make_place(self, steps: Sequence[int]) -> None:
        """Lay the file out for other steps to come than were foreseen; what was saved stays, and no more place."""
        found, _ = _found(self.path, self.slab)
        if found is None or self._provenance is None:
            return
        kept = [step for step, time in zip(found.steps, found.times, strict=True) if not np.isnan(time)]
        self.steps = {step: index for index, step in enumerate(sorted({*kept, *steps}))}
        self._move_over(found, kept, self._provenance)

    def resume(self, step: int, provenance: Provenance) -> str:
        """Go on after a step: what was saved up to it stays, whatever else was asked for then.

        Returns what is lost, or ''; a file that cannot be read is put aside. Raises InputError for one that is locked.
        """
        self._provenance = provenance
        found, problem = _found(self.path, self.slab)
        kept = [] if found is None else found.reached(step)
        self.steps = {n: i for i, n in enumerate(sorted({*kept, *(n for n in self.steps if n >= step)}))}
        self._kept = frozenset(kept)
        if found is None:
            self.make(provenance)
        elif found.steps == tuple(self.steps) and set(found.names) == set(self.names):
            layout.change(self.path, self.slab, provenance.renew)
            self._stamp(slice(len(kept), None), np.nan)
            self._identity = self.slab.agree(_identity(self.path))
            self._draw()
        else:
            problem = self._move_over(found, kept, provenance)
        return problem

    def lacks(self, step: int) -> bool:
        """Whether the maps of the step after which it goes on are due, and were not saved then."""
        return step in self.steps and step not in self._kept

    def renew(self, provenance: Provenance) -> None:
        """Put what has changed of its origin into the file."""
        self._provenance = provenance
        layout.change(self.path, self.slab, provenance.renew)

    def save(self, step: int, time: float, maps: Mapping[str, Array]) -> None:
        """Put the maps of one instant into their place."""
        index = self.steps[step]
        rows = {name: np.ascontiguousarray(maps[name], dtype=np.float64) for name in self.names}
        hdf5.write(self.path, self.slab, [hdf5.Part(name, (index,), rows[name]) for name in self.names])
        self._stamp(index, time)
        if self.slab.agree(clock.monotonic() - self._drawn > XDMF_SECONDS):
            self._draw()

    def sync(self, provenance: Provenance) -> None:
        """Wait until all that was saved is on the disk, with what is new of its origin; bring fields.xdmf up to date.

        Raises RunError, also when the file was removed or replaced.
        """

        def look() -> None:
            if _identity(self.path) != self._identity:
                raise ValueError("it was removed, or replaced by another file, during the run: maps are lost")

        hdf5.on_root(self.slab, look, f"cannot write {self.path}")
        self.renew(provenance)
        hdf5.sync(self.path, self.slab)
        self._draw()

    # -- layout -------------------------------------------------------------------------------------------------------

    def _build(self, file: h5py.File, provenance: Provenance) -> None:
        slab, count = self.slab, len(self.steps)
        file.attrs["kind"] = KIND
        provenance.write(file)
        axes = {"t": np.full(count, np.nan)}
        for axis, length, points in zip("xy", self.size, (slab.nx, slab.ny), strict=True):
            axes[axis] = np.arange(points) * (length / points)
        for axis, values in axes.items():
            dataset = layout.fixed(file, axis, values.shape, np.float64)
            dataset[...] = values
            dataset.make_scale(axis)
            dataset.attrs["units"] = "s" if axis == "t" else "m"
        step = layout.fixed(file, "step", (count,), np.int64)
        step[...] = list(self.steps)
        step.dims[0].attach_scale(file["t"])
        for name in self.names:
            dataset = layout.fixed(file, name, (count, slab.ny, slab.nx), np.float64)
            dataset.attrs["units"] = UNITS[name]
            for dimension, axis in enumerate("tyx"):
                dataset.dims[dimension].attach_scale(file[axis])

    def _publish(self, new: Path) -> None:
        """Give a file that is ready its name."""
        hdf5.on_root(self.slab, lambda: new.replace(self.path), f"cannot write {self.path}")
        self._identity = self.slab.agree(_identity(self.path))
        self._draw()

    def _move_over(self, found: "Layout", kept: Sequence[int], provenance: Provenance) -> str:
        """Lay a new file out and copy what stays; a map that was not saved then is NaN.

        A file that also holds what is not ours is put aside; returns what to say of that.
        """
        old, new = self.path, self.slab.agree(files.unused(self.path))
        layout.lay_out(new, self.slab, lambda file: self._build(file, provenance))
        self.path = new
        rows = np.empty(self.slab.shape)
        for step in kept:
            for name in self.names:
                rows.fill(np.nan)
                if name in found.names:
                    hdf5.read(old, self.slab, [hdf5.Part(name, (found.steps.index(step),), rows)])
                hdf5.write(new, self.slab, [hdf5.Part(name, (self.steps[step],), rows)])
        self._stamp([self.steps[step] for step in kept], [found.times[found.steps.index(step)] for step in kept])
        hdf5.sync(new, self.slab)
        self.path = old
        aside = self.slab.agree(files.put_aside(old) if self.slab.root and found.others else None)
        self._publish(new)
        return f"{old} held {', '.join(found.others)}, which this program did not write: it is kept as {aside}" * (
            aside is not None
        )

    def _stamp(self, index: int | slice | list[int], time: float | list[float]) -> None:
        def stamp() -> None:
            with h5py.File(self.path, "r", locking=False) as file:  # the output directory is ours
                times = file["t"][...]
            times[index] = time
            layout.put(self.path, {"t": times})

        hdf5.on_root(self.slab, stamp, f"cannot write {self.path}")

    def _draw(self) -> None:
        target = self.path.with_suffix(".xdmf")
        if self.slab.root:
            try:
                with h5py.File(self.path, "r", locking=False) as file:
                    times, steps = file["t"][...], file["step"][...]
                points = (self.slab.ny, self.slab.nx)
                files.write(target, xdmf(self.path.name, times, steps, points, self.size, self.names))
                self.trouble = ""
            except hdf5.FAILURES as error:
                self.trouble = f"cannot write {target}: {hdf5.reason(error)}"
        self._drawn = clock.monotonic()


def cut_back(path: Path, slab: Slab, step: int) -> str:
    """Take the instants after a step as not reached, in a file to which nothing more is added; collective.

    As for `FieldsFile.resume`, returns what is lost, and raises InputError.
    """
    if not slab.agree(slab.root and os.path.lexists(path)):
        return ""
    found, problem = _found(path, slab)

    def forget() -> None:
        if found is not None:
            layout.put(path, {"t": np.where(np.array(found.steps) > step, np.nan, found.times)})

    hdf5.on_root(slab, forget, f"cannot write {path}")
    return problem


class Layout:
    """What a file of fields holds."""

    def __init__(self, file: h5py.File) -> None:
        self.names = tuple(name for name in UNITS if name in file)
        self.others = tuple(name for name in file if name not in (*UNITS, *"txy", "step"))
        self.steps: tuple[int, ...] = tuple(file["step"][...].tolist())
        self.times: NDArray[np.float64] = file["t"][...]
        for name in self.names:
            if file[name].shape != (len(self.steps), len(file["y"]), len(file["x"])):
                raise ValueError(f"{name} has shape {file[name].shape}")

    def reached(self, step: int) -> list[int]:
        """The instants that were saved, up to a step."""
        pairs = zip(self.steps, self.times, strict=True)
        return [number for number, time in pairs if number <= step and not np.isnan(time)]


def _found(path: Path, slab: Slab) -> tuple[Layout | None, str]:
    """What a file of fields holds, and what is lost; collective. Raises InputError for one that is locked or a link."""
    found: tuple[Layout | None, str] = None, ""

    def look() -> None:
        nonlocal found
        found = _layout(path)

    hdf5.on_root(slab, look, f"cannot read {path}", InputError)
    return slab.agree(found)


def _layout(path: Path) -> tuple[Layout | None, str]:
    """As `_found`; root only. A file that cannot be read is put aside, whatever it is."""
    if not os.path.lexists(path):
        return None, f"{path} is missing: the fields saved so far are lost"
    if not S_ISREG(path.lstat().st_mode):
        raise InputError(f"{path} is a link or no regular file; move it away to go on without the fields saved so far")
    if holder := hdf5.lock_holder(path):
        raise InputError(f"{path} is locked by {holder}; let it close the file, and run again")
    try:
        with h5py.File(path, "r") as file:
            return Layout(file), ""
    except hdf5.FAILURES as error:
        kept = files.put_aside(path)
        return None, f"{path} cannot be read ({hdf5.reason(error)}): it is kept as {kept}, and a new file is begun"


def _identity(path: Path) -> tuple[int, int]:
    """Which file a path leads to, by device and number; of none, zeros."""
    try:
        found = path.lstat()
        return found.st_dev, found.st_ino
    except OSError:
        return 0, 0


def xdmf(
    file: str, times: Array, steps: Array, shape: tuple[int, int], size: tuple[float, float], names: tuple[str, ...]
) -> str:
    """The XDMF text that describes the saved instants: maps of one layer of points in the plane z = 0.

    XDMF counts z, y, x, the fastest last. Of a mesh of two dimensions ParaView's reader takes the first for z, which
    puts it into the y-z plane; a mesh of three with one layer has no such choice. Readers show one map per time: where
    several instants have the same one, as those of loads without duration, the numbers of the steps stand for times.
    """
    (ny, nx), (lx, ly) = shape, size
    saved = np.flatnonzero(~np.isnan(times))
    told = times if len(set(times[saved].tolist())) == saved.size else steps.astype(np.float64)
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
            f'<Grid><Time Value="{float(told[index])!r}"/><Topology TopologyType="3DCoRectMesh" '
            f'Dimensions="1 {ny} {nx}"/><Geometry GeometryType="ORIGIN_DXDYDZ">'
            f'<DataItem Dimensions="3" {real} Format="XML">0 0 0</DataItem>'
            f'<DataItem Dimensions="3" {real} Format="XML">{spacing}</DataItem></Geometry>{attributes}</Grid>'
        )
    return (
        '<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid GridType="Collection" CollectionType="Temporal">'
        + "\n".join(grids)
        + "</Grid></Domain></Xdmf>\n"
    )
