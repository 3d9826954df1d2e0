"""Checkpoints, which hold the complete state of a run at one instant, and files of heights that were given in Python.

A checkpoint is an HDF5 file with checksums. Maps are global datasets `part/name` of shape (ny, nx), so that any number
of ranks can read them; numbers are small datasets. Maps and numbers are in the units of the run, which are powers of
two. A dataset times its attribute `unit` is in SI units.

Each row of a map has its CRC-32 in the group `checksums`. The seal is a text in front of the HDF5 data (the user block
of the file), which is written last. It has the checksum of all bytes outside of maps. The seal is checked before HDF5
opens the file, since HDF5 may crash on a damaged file. The file has a temporary name until it is complete.

Heights that were given as an array in Python are stored as a file next to the job or the checkpoint. A run that
continues from the checkpoint reads this file.
"""

import json
import os
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, RunError
from ..job import HeightArray
from ..parallel.slab import Array, Slab
from ..physics.records import Entry
from . import files, hdf5
from .hdf5 import Link, Provenance, read_chain

FORMAT = 2
TITLE = "parcontact checkpoint, format "
SEAL = 4096  # tuning: size of the seal [bytes]
SUMS = "checksums"


@dataclass(frozen=True)
class TableMark:
    """State of measures.csv: the number of its rows, and the text of the last row."""

    rows: int = 0
    last: str = ""


@dataclass(frozen=True)
class Contents:
    """Contents of an undamaged checkpoint except its maps.

    Datasets are identified by their names. `numbers` are the small datasets, and `units` the units of all datasets
    [SI]. `maps` are the types of the maps, which have the shape `shape` (ny, nx), and `sums` the checksums of their
    rows.
    """

    path: Path
    step: int
    time: float
    job: dict[str, Any]
    run: str
    table: TableMark
    chain: tuple[Link, ...]
    shape: tuple[int, int]
    units: dict[str, float]
    numbers: dict[str, NDArray[Any]]
    maps: dict[str, np.dtype[Any]]
    sums: dict[str, NDArray[np.uint32]]


@dataclass(frozen=True)
class Facts:
    """Facts about a checkpoint: its job as plain data, the provenance of the file, and the position of the run.

    `run` is the id of the run, equal in all files of a directory; `table` is the state of its measures.csv.
    """

    job: Mapping[str, Any]
    provenance: Provenance
    run: str = ""
    table: TableMark = TableMark()
    step: int = 0
    time: float = 0.0

    def write(self, file: h5py.File) -> None:
        file.attrs["step"], file.attrs["time"] = self.step, self.time
        file.attrs["plain job"] = json.dumps(self.job)
        file.attrs["run"], file.attrs["table"] = self.run, json.dumps(asdict(self.table))
        self.provenance.write(file)


def write_checkpoint(path: Path, slab: Slab, facts: Facts, entries: Mapping[str, Entry]) -> None:
    """Write a checkpoint. Collective. After an error an existing file of this name is unchanged."""
    maps = _maps(entries)
    part = slab.agree(files.unused(path))

    def build(file: h5py.File) -> None:
        facts.write(file)
        for name, rows in maps.items():
            hdf5.fixed(file, name, (slab.ny, slab.nx), rows.dtype)
        for name, entry in entries.items():
            if name in maps:
                hdf5.fixed(file, f"{SUMS}/{name}", (slab.ny,), np.uint32)
            else:
                file[name] = entry.value
            file[name].attrs["unit"], file[name].attrs["symbol"] = entry.unit, entry.symbol

    def finish() -> None:
        hdf5.put(part, {f"{SUMS}/{name}": np.concatenate([sums[name] for sums in everyone]) for name in maps})
        _seal(part)

    def publish() -> None:
        files.make_room(path, is_one)
        part.replace(path)
        hdf5.sync_one(path.parent)

    try:
        size = sum(rows.itemsize for rows in maps.values()) * slab.nx * slab.ny
        hdf5.lay_out(part, slab, build, size, SEAL)
        hdf5.write_rows(part, slab, [hdf5.Slice(name, (), rows) for name, rows in maps.items()])
        everyone = slab.from_all({name: row_sums(rows) for name, rows in maps.items()})
        hdf5.write_on_root(slab, finish, f"cannot write {part}")
        hdf5.sync(part, slab)
        hdf5.write_on_root(slab, publish, f"cannot create {path}")
    except RunError:
        if slab.root:
            with suppress(OSError):
                part.unlink()
        raise


def _maps(entries: Mapping[str, Entry]) -> dict[str, Array]:
    return {name: np.asarray(entry.value) for name, entry in entries.items() if entry.is_map}


def row_sums(rows: Array) -> NDArray[np.uint32]:
    """Return the CRC-32 of each row of a map."""
    return np.array([zlib.crc32(row) for row in rows], dtype=np.uint32)


def inspect(path: Path) -> Contents:
    """Return the contents of a checkpoint except its maps, which are checked by `verify`. Raises InputError for a
    damaged file."""
    try:
        if problem := _broken(path):
            raise InputError(f"{path} {problem}")
        with h5py.File(path, "r") as file:
            return _contents(path, file)
    except hdf5.FAILURES as error:
        raise InputError(f"{path} cannot be read: {files.reason(error)}") from error


def is_one(path: Path) -> bool:
    """Return True if a file begins like a checkpoint. Raises OSError."""
    with path.open("rb") as file:
        return file.read(len(TITLE)) == TITLE.encode()


def _seal(path: Path) -> None:
    with h5py.File(path, "r") as hdf:
        regions = find_regions(hdf)
    with path.open("r+b") as file:
        size = file.seek(0, os.SEEK_END)
        facts = {"bytes": size, "maps": regions, "checksum": _outside(file, size, regions)}
        file.seek(0)
        file.write(f"{TITLE}{FORMAT}\n{json.dumps(facts)}\n".encode())


def _broken(path: Path) -> str:
    """Return the damage of a file by its seal, or ''."""
    with path.open("rb") as file:
        title, facts, *_ = [*file.read(SEAL).split(b"\n"), b""]
        if not title.startswith(TITLE.encode()):
            return "is incomplete or damaged: it has no seal"
        if (version := int(title[len(TITLE) :])) != FORMAT:
            other = "a newer" if version > FORMAT else "an older"
            return f"has format {version} of {other} parcontact; format {FORMAT} was expected"
        try:
            wanted, regions, checksum = itemgetter("bytes", "maps", "checksum")(json.loads(facts))
        except (ValueError, KeyError, TypeError):
            return "is damaged: its seal cannot be read"
        if (size := file.seek(0, os.SEEK_END)) != wanted:
            return f"is damaged: it has {size} bytes instead of {wanted}"
        if _outside(file, size, regions) != checksum:
            return "is damaged: the bytes outside of its maps do not match their checksum"
    return ""


def _outside(file: BinaryIO, size: int, regions: Sequence[tuple[int, int]]) -> int:
    """Return the CRC-32 of all bytes outside of the seal and of the maps."""
    total, start = 0, SEAL
    for first, last in [*regions, (size, size)]:
        total, start = zlib.crc32(os.pread(file.fileno(), first - start, start), total), last
    return total


def find_regions(file: h5py.File) -> list[tuple[int, int]]:
    """Return the byte ranges of the maps in a file, in the order of the file. Adjacent ranges are merged."""
    maps = [item for item in _datasets(file).values() if item.ndim > 1]
    places = [(item.id.get_offset(), item.nbytes) for item in maps if item.id.get_offset() is not None]
    merged: list[tuple[int, int]] = []
    for start, length in sorted(place for place in places if place[1]):
        merged.append((merged.pop()[0] if merged and merged[-1][1] == start else start, start + length))
    return merged


def _contents(path: Path, file: h5py.File) -> Contents:
    found = {name: item for name, item in _datasets(file).items() if not name.startswith(SUMS)}
    maps = {name: item.dtype for name, item in found.items() if item.ndim == 2}
    shape = next((file[name].shape for name in maps), (0, 0))
    table = json.loads(file.attrs.get("table", "{}"))
    return Contents(
        path,
        int(file.attrs["step"]),
        float(file.attrs["time"]),
        json.loads(file.attrs["plain job"]),
        str(file.attrs.get("run", "")),
        TableMark(table.get("rows", 0), table.get("last", "")),
        read_chain(file),
        shape,
        {name: float(item.attrs["unit"]) for name, item in found.items()},
        {name: item[()] for name, item in found.items() if item.ndim < 2},
        maps,
        {name: file[f"{SUMS}/{name}"][...] for name in maps},
    )


def verify(contents: Contents, slab: Slab) -> str:
    """Check the maps against their checksums. Collective. Each rank checks its own rows. Return a sentence if a map is
    damaged, else ''."""
    rows = np.empty(0)
    try:
        for name, dtype in contents.maps.items():
            if rows.dtype != dtype or rows.shape != slab.shape:
                rows = np.empty(slab.shape, dtype)
            hdf5.read_rows(contents.path, slab, [hdf5.Slice(name, (), rows)])
            bad = np.flatnonzero(row_sums(rows) != contents.sums[name][slab.rows])
            if count := int(slab.sum(float(bad.size))[0]):
                return f"{contents.path} is damaged: {count} of {slab.ny} rows of {name} do not match their checksums"
    except RunError as error:
        return str(error)
    return ""


def read_maps(contents: Contents, slab: Slab, entries: Mapping[str, Entry]) -> None:
    """Read the maps of a checkpoint into the maps of `entries`, and convert them to the units of the entries.
    Collective."""
    maps = _maps(entries)
    hdf5.read_rows(contents.path, slab, [hdf5.Slice(name, (), rows) for name, rows in maps.items()])
    for name, rows in maps.items():
        if contents.units[name] != entries[name].unit:
            rows *= contents.units[name] / entries[name].unit


def _datasets(file: h5py.File) -> dict[str, h5py.Dataset]:
    names: list[str] = []
    file.visit(names.append)
    return {name: file[name] for name in sorted(names) if isinstance(file[name], h5py.Dataset)}


def store(surface: Iterable[Any], directory: Path, slab: Slab) -> None:
    """Write the height files of a job's surface, unless they exist. Collective. Raises InputError."""

    def write() -> None:
        for heights in (shape.heights for shape in surface if isinstance(shape, HeightArray)):
            path = directory / heights.name
            if not path.is_file():
                with files.replaced(path) as file:
                    np.save(file, np.asarray(heights.values))

    hdf5.write_on_root(slab, write, f"cannot write the heights of the surface into {directory}", InputError)


def located(job: dict[str, Any], checkpoint: Path, elsewhere: bool) -> dict[str, Any]:
    """Return a stored job in which files of heights have absolute paths. Root only.

    These files are in the directory of the checkpoint, or in the parent of this directory. Raises InputError for a
    missing file, unless `elsewhere` is True, which means that the file may be in another place.
    """
    for index, shape in enumerate(job["surface"]):
        name = Path(shape.get("path", "/"))
        if not name.is_absolute():
            here, above = checkpoint.parent / name, checkpoint.parent.parent / name
            shape["path"] = str((above if above.is_file() and not here.is_file() else here).absolute())
            if not (elsewhere or Path(shape["path"]).is_file()):
                raise InputError(
                    f"{checkpoint} needs {name}, the heights of its surface, which were written with it: move both "
                    f"files, or say where it is with set={{'surface.{index}.path': ...}}"
                )
    return job
