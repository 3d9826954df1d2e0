"""What a file of a run holds, and whether it is sound."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..parallel.mpi import MPI
from ..parallel.slab import Array, Slab
from ..storage import checkpoint, fields, hdf5
from ..storage.provenance import Link, read_budget, read_chain

SHOWN = 20  # numbers of one name at most
NOT_HDF5 = "file signature not found"  # what HDF5 says of another file


def describe(path: Path) -> tuple[str, bool]:
    """Text about a checkpoint, a file of fields or an output directory, and whether it is sound; one rank reads it."""
    if path.is_dir():
        from . import info_directory  # with the columns of a run, and so with what computes them

        return info_directory.describe(path)
    try:
        if checkpoint.is_one(path):
            return _checkpoint(path)
        with h5py.File(path, "r") as file:
            if file.attrs.get("kind") == fields.KIND:
                return _fields(path, file)
    except FileNotFoundError:
        raise InputError(f"{path} does not exist") from None
    except hdf5.FAILURES as error:
        if NOT_HDF5 in str(error):
            raise InputError(f"{path} is neither a checkpoint nor a file of fields: it is no HDF5 file") from None
        return f"{path} cannot be read: {hdf5.reason(error)}", False
    raise InputError(f"{path} is neither a checkpoint nor a file of fields")


def describe_all(paths: Sequence[Path]) -> tuple[str, bool]:
    """The texts about several, one below the other, and whether all are sound; one that is nothing is told so."""
    found = []
    for path in paths:
        try:
            found.append(describe(path))
        except InputError as error:
            if len(paths) == 1:
                raise
            found.append((str(error), False))
    return "\n".join(text for text, _ in found), all(sound for _, sound in found)


def _checkpoint(path: Path) -> tuple[str, bool]:
    try:
        contents = checkpoint.inspect(path)
    except InputError as error:
        return str(error), False
    ny, nx = contents.shape
    problem = checkpoint.verify(contents, Slab(MPI.COMM_SELF, nx, ny))
    lines = [f"{path}: checkpoint after step {contents.step}, t = {contents.time:g} s, {nx} x {ny} points"]
    lines += _runs(contents.chain)
    lines += [f"  map    {name} ({dtype.name})" for name, dtype in contents.maps.items()]
    lines += [f"  number {name} = {_short(value * contents.units[name])}" for name, value in contents.numbers.items()]
    lines.append(problem or "sound: every row matches its checksum")
    return "\n".join(lines), not problem


def _fields(path: Path, file: h5py.File) -> tuple[str, bool]:
    layout = fields.Layout(file)
    saved = [index for index, time in enumerate(layout.times) if not np.isnan(time)]
    lines = [f"{path}: {', '.join(layout.names)} on {len(file['x'])} x {len(file['y'])} points"]
    lines += [*_runs(read_chain(file)), *_budget(read_budget(file))]
    lines.append(f"  {len(saved)} of {len(layout.steps)} instants saved")
    if saved:
        first, last = saved[0], saved[-1]
        lines[-1] += f", t = {layout.times[first]:g} s (step {layout.steps[first]})"
        lines[-1] += f" to {layout.times[last]:g} s (step {layout.steps[last]})"
    bad = [f"{name} after step {layout.steps[i]}" for name in layout.names for i in saved if not _finite(file[name][i])]
    lines.append(f"damaged: not finite are {', '.join(bad)}" if bad else "sound: all saved maps are finite")
    return "\n".join(lines), not bad


def _runs(chain: tuple[Link, ...]) -> list[str]:
    return [
        f"  {'run' if link.runs == 1 else f'{link.runs} runs'} from step {link.from_step} on {link.ranks} rank"
        f"{'s' if link.ranks > 1 else ''}, {link.program}, {link.started}"
        for link in chain
    ]


def _budget(budget: Mapping[str, Any]) -> Iterator[str]:
    """How wrong friction and area are, by part."""
    for name, parts in budget.items():
        if isinstance(parts, dict):
            yield f"  error of {name}: " + ", ".join(f"{part} {100 * value:.2g} %" for part, value in parts.items())


def _short(value: NDArray[Any]) -> str:
    return json.dumps(value.tolist()) if np.size(value) <= SHOWN else f"{np.size(value)} values"


def _finite(values: Array) -> bool:
    return bool(np.isfinite(values).all())
