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

from ..parallel.slab import Array, Slab
from . import hdf5, layout
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
        self._drawn = 0.0

    def make(self, provenance: Provenance) -> None:
        """Lay the file out anew."""
        layout.lay_out(self.path, self.slab, lambda file: self._build(file, provenance))
        self._draw()

    def resume(self, step: int, provenance: Provenance) -> str:
        """Go on after a step: what was saved up to it stays, whatever else was asked for then.

        Returns what is lost, or ''.
        """
        found, problem = self.slab.agree(_layout(self.path) if self.slab.root else (None, ""))
        kept = [] if found is None else found.reached(step)
        self.steps = {n: i for i, n in enumerate(sorted({*kept, *(n for n in self.steps if n > step)}))}
        if found is None:
            self.make(provenance)
        elif found.steps == tuple(self.steps) and set(found.names) == set(self.names):
            layout.change(self.path, self.slab, provenance.renew)
            self._stamp(slice(len(kept), None), np.nan)
            self._draw()
        else:
            self._move_over(found, kept, provenance)
        return problem

    def save(self, step: int, time: float, maps: Mapping[str, Array]) -> None:
        """Put the maps of one instant into their place."""
        index = self.steps[step]
        rows = {name: np.ascontiguousarray(maps[name], dtype=np.float64) for name in self.names}
        hdf5.write(self.path, self.slab, [hdf5.Part(name, (index,), rows[name]) for name in self.names])
        self._stamp(index, time)
        if self.slab.agree(clock.monotonic() - self._drawn > XDMF_SECONDS):
            self._draw()

    def sync(self) -> None:
        """Wait until all that was saved is on the disk, and bring fields.xdmf up to date."""
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

    def _move_over(self, found: "Layout", kept: Sequence[int], provenance: Provenance) -> None:
        """Lay a new file out and copy what stays; a map that was not saved then is NaN."""
        old, new = self.path, self.path.with_name(self.path.name + ".part")
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
        hdf5.on_root(self.slab, lambda: new.replace(old), f"cannot write {old}")
        self._draw()

    def _stamp(self, index: int | slice | list[int], time: float | list[float]) -> None:
        def stamp() -> None:
            with h5py.File(self.path, "r") as file:
                times = file["t"][...]
            times[index] = time
            layout.put(self.path, {"t": times})

        hdf5.on_root(self.slab, stamp, f"cannot write {self.path}")

    def _draw(self) -> None:
        def draw() -> None:
            with h5py.File(self.path, "r") as file:
                times, steps = file["t"][...], file["step"][...]
            text = xdmf(self.path.name, times, steps, (self.slab.ny, self.slab.nx), self.size, self.names)
            with hdf5.replaced(self.path.with_suffix(".xdmf")) as part:
                part.write_text(text)

        hdf5.on_root(self.slab, draw, f"cannot write {self.path.with_suffix('.xdmf')}")
        self._drawn = clock.monotonic()


def cut_back(path: Path, slab: Slab, step: int) -> None:
    """Take the instants after a step as not reached, in a file to which nothing more is added; collective."""

    def forget() -> None:
        if path.exists():
            with h5py.File(path, "r") as file:
                times = np.where(file["step"][...] > step, np.nan, file["t"][...])
            layout.put(path, {"t": times})

    hdf5.on_root(slab, forget, f"cannot write {path}")


class Layout:
    """What a file of fields holds."""

    def __init__(self, file: h5py.File) -> None:
        self.names = tuple(name for name in UNITS if name in file)
        self.steps: tuple[int, ...] = tuple(file["step"][...].tolist())
        self.times: NDArray[np.float64] = file["t"][...]
        for name in self.names:
            if file[name].shape != (len(self.steps), len(file["y"]), len(file["x"])):
                raise ValueError(f"{name} has shape {file[name].shape}")

    def reached(self, step: int) -> list[int]:
        """The instants that were saved, up to a step."""
        pairs = zip(self.steps, self.times, strict=True)
        return [number for number, time in pairs if number <= step and not np.isnan(time)]


def _layout(path: Path) -> tuple[Layout | None, str]:
    try:
        with h5py.File(path, "r") as file:
            return Layout(file), ""
    except FileNotFoundError:
        return None, f"{path} is missing: the fields saved so far are lost"
    except hdf5.FAILURES as error:
        return None, f"{path} cannot be read ({hdf5.reason(error)}): the fields saved so far are lost"


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
