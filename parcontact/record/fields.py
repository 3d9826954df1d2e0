"""fields.h5: saved maps, and fields.xdmf, through which ParaView reads them.

The file is laid out for all instants of the run before the first: saving one writes numbers into their places and its
time last, so that a run that dies leaves a readable file. Instants not reached yet have the time NaN.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import h5py
import numpy as np

from ..parallel.slab import Array, Slab
from . import hdf5

UNITS = {"pressure": "Pa", "displacement": "m", "gap": "m"}


class FieldsFile:
    """Saved maps of shape (t, y, x), with coordinates; every method is collective."""

    def __init__(self, path: Path, slab: Slab, size: tuple[float, float], names: tuple[str, ...], count: int) -> None:
        self.path, self.slab, self.size, self.names, self.count = path, slab, size, names, count

    def make(self, describe: Callable[[h5py.File], None]) -> None:
        """Lay the file out; `describe(file)` adds the provenance."""

        def build(file: h5py.File) -> None:
            slab = self.slab
            describe(file)
            axes = {"t": np.full(self.count, np.nan)}
            for axis, length, points in zip("xy", self.size, (slab.nx, slab.ny), strict=True):
                axes[axis] = np.arange(points) * (length / points)
            for axis, values in axes.items():
                file[axis] = values
                file[axis].make_scale(axis)
                file[axis].attrs["units"] = "s" if axis == "t" else "m"
            for name in self.names:
                dataset = hdf5.fixed(file, name, (self.count, slab.ny, slab.nx), np.dtype(np.float64))
                dataset.attrs["units"] = UNITS[name]
                for dimension, axis in enumerate("tyx"):
                    dataset.dims[dimension].attach_scale(file[axis])

        hdf5.lay_out(self.path, self.slab, build)
        self._write_xdmf()

    def save(self, index: int, time: float, maps: Mapping[str, Array]) -> None:
        """Put the maps of one instant into their place."""
        rows = {name: np.ascontiguousarray(maps[name], dtype=np.float64) for name in self.names}
        hdf5.write(self.path, self.slab, [hdf5.Part(name, (index,), rows[name]) for name in self.names])
        self._stamp(index, time)

    def forget(self, index: int) -> None:
        """Take the instants from `index` on as not reached."""
        self._stamp(slice(index, None), np.nan)

    def _stamp(self, index: int | slice, time: float) -> None:
        def stamp() -> None:
            with h5py.File(self.path, "r+") as file:
                file["t"][index] = time

        hdf5.on_root(self.slab, stamp, f"cannot write {self.path}")
        self._write_xdmf()

    def _write_xdmf(self) -> None:
        def write() -> None:
            with h5py.File(self.path, "r") as file:
                times = file["t"][...]
            text = xdmf(self.path.name, times, (self.slab.ny, self.slab.nx), self.size, self.names)
            with hdf5.replaced(self.path.with_suffix(".xdmf")) as part:
                part.write_text(text)

        hdf5.on_root(self.slab, write, f"cannot write {self.path.with_suffix('.xdmf')}")


def xdmf(
    file: str, times: Array, shape: tuple[int, int], size: tuple[float, float], names: tuple[str, ...]
) -> str:
    """The XDMF text that describes the saved instants."""
    (ny, nx), (lx, ly) = shape, size
    grids = []
    for index, time in enumerate(times):
        if np.isnan(time):
            continue
        attributes = "".join(
            f'<Attribute Name="{name}" Center="Node"><DataItem ItemType="HyperSlab" Dimensions="{ny} {nx}">'
            f'<DataItem Dimensions="3 3" Format="XML">{index} 0 0 1 1 1 1 {ny} {nx}</DataItem>'
            f'<DataItem Dimensions="{len(times)} {ny} {nx}" NumberType="Float" Precision="8" Format="HDF">'
            f"{file}:/{name}</DataItem></DataItem></Attribute>"
            for name in names
        )
        grids.append(
            f'<Grid><Time Value="{time!r}"/><Topology TopologyType="2DCoRectMesh" Dimensions="{ny} {nx}"/>'
            f'<Geometry GeometryType="ORIGIN_DXDY"><DataItem Dimensions="2" Format="XML">0 0</DataItem>'
            f'<DataItem Dimensions="2" Format="XML">{ly / ny!r} {lx / nx!r}</DataItem></Geometry>{attributes}</Grid>'
        )
    return (
        '<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid GridType="Collection" CollectionType="Temporal">'
        + "\n".join(grids)
        + "</Grid></Domain></Xdmf>\n"
    )
