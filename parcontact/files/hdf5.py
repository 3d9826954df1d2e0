"""Maps and provenance in HDF5 files: the runs that made a file, and the references to cite.

Maps are written by MPI-IO if h5py supports it, else by the ranks in turn; both give the same files. A file has space
for all maps before the first map is written, and root writes everything else. Writing rows of maps does not change the
structure of the file, so a killed run leaves a readable file. An error on one rank is raised on all ranks as RunError.
"""

import errno
import json
import os
import platform
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from .. import __version__
from ..errors import InputError, RunError
from ..parallel import root
from ..parallel.slab import MPI, Array, Slab
from ..text_tables import OWN_FORMATS
from .files import reason, without_mark

T = TypeVar("T")
MPI_IO = h5py.get_config().mpi  # else ranks act in turn
# errors that h5py raises for damaged files
FAILURES = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)
MEND = "restore the whole file, or move it away to continue without its maps"
FULL = 1 << 16  # tuning: free space below which a failure of MPI-IO means a full disk [bytes]
DOUBLE = 8  # size of a number in a map [bytes]
RESERVE = 1 << 20  # tuning: space tested for data other than maps, as HDF5 crashes on a full disk [bytes]


class Slice(NamedTuple):
    """This rank's rows of one map in the dataset `name`. `at` are the indices of the map along the first axes of the
    dataset. `rows` is the array from which these rows are written, or into which they are read."""

    name: str
    at: tuple[int, ...]
    rows: Array


def write_rows(path: Path, slab: Slab, parts: Iterable[Slice]) -> None:
    """Write the rows of every rank to their places. Collective."""
    _move(path, slab, list(parts), True)


def read_rows(path: Path, slab: Slab, parts: Iterable[Slice]) -> None:
    """Read the rows of every rank from a file into the arrays `rows` of all `parts`. Collective."""
    _move(path, slab, list(parts), False)


def open_results(path: Path) -> h5py.File:
    """Open a file of results for reading. Raises FileNotFoundError, and InputError if it is damaged or has links to
    other files."""
    try:
        file = h5py.File(path, "r", locking=False)
    except FileNotFoundError:
        raise
    except FAILURES as error:
        raise InputError(f"{path} cannot be read: {reason(error)}; {MEND}") from error
    for name in file:
        outside = isinstance(file.get(name, getlink=True), h5py.ExternalLink)
        if outside or (isinstance(item := file[name], h5py.Dataset) and (item.is_virtual or item.external is not None)):
            file.close()
            raise InputError(f"{path}: {name} is a link to another file, which is not followed; copy it into this file")
    return file


def sync(path: Path, slab: Slab) -> None:
    """Flush the data of all ranks to disk. Collective."""
    problem = ""
    try:
        sync_one(path)
    except OSError as error:
        problem = f"cannot write {path}: {reason(error)}"
    raise_first(slab, problem)


def sync_one(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_on_root(slab: Slab, action: Callable[[], T], what: str, kind: type[Exception] = RunError) -> T:
    """Run `action` on root and return its result on all ranks. Collective. If it fails, raise `kind` on all ranks, with
    a message that begins with `what`."""

    def attempt() -> T:
        try:
            return action()
        except FAILURES as error:
            raise kind(f"{what}: {reason(error)}") from error

    return root.on_root(slab.comm, attempt)


def raise_first(slab: Slab, problem: str) -> None:
    """Raise RunError on all ranks with the `problem` of the first rank that has a problem. `problem` is '' on ranks
    without a problem. Collective."""
    if problem := next((text for text in slab.from_all(problem) if text), ""):
        raise RunError(problem)


def _move(path: Path, slab: Slab, parts: Sequence[Slice], writes: bool) -> None:
    """Write or read rows at their places. Collective. If a rank cannot take part, all ranks raise before any access."""
    what, problem, places = f"cannot {'write' if writes else 'read'} {path}", "", list[int]()
    try:
        os.close(os.open(path, os.O_RDWR if writes else os.O_RDONLY))
        with h5py.File(path, "r", locking=False) as file:
            places = [_place(file[part.name], part, slab) for part in parts]
    except OSError as error:
        problem = f"cannot open {path}: {reason(error)}"
    except FAILURES as error:
        problem = f"{what}: {reason(error)}"
    raise_first(slab, problem)
    if problem := (_together if MPI_IO and slab.comm.size > 1 else _by_turns)(path, slab, parts, places, writes):
        space = os.statvfs(path)
        full = writes and space.f_bavail * space.f_frsize < FULL
        problem = f"{what}: {os.strerror(errno.ENOSPC) if full else problem}"
    raise_first(slab, problem)


def _place(dataset: h5py.Dataset, part: Slice, slab: Slab) -> int:
    """Return the offset of this rank's rows in the file [bytes]. Raises ValueError for another type or shape."""
    if (dataset.dtype, dataset.shape[-2:], slab.shape) != (part.rows.dtype, (slab.ny, slab.nx), part.rows.shape):
        kinds = f"{dataset.dtype} {dataset.shape}; {part.rows.dtype} with rows {part.rows.shape} was expected"
        raise ValueError(f"{part.name} is of {kinds}")
    if not part.rows.size:
        return 0
    index = int(np.ravel_multi_index((*part.at, slab.rows.start, 0), dataset.shape))
    return int(dataset.id.get_offset()) + index * dataset.dtype.itemsize


def _by_turns(path: Path, slab: Slab, parts: Sequence[Slice], places: Sequence[int], writes: bool) -> str:
    """Access the file by one rank after the other. Return the failure on this rank, or ''."""
    problem = ""
    for rank in range(slab.comm.size):
        if rank == slab.comm.rank and slab.shape[0]:
            try:
                with path.open("r+b") if writes else path.open("rb") as file:
                    for part, place in zip(parts, places, strict=True):
                        file.seek(place)
                        if (file.write if writes else file.readinto)(part.rows.data.cast("B")) < part.rows.nbytes:
                            raise ValueError("the file ends too early")
            except FAILURES as error:
                problem = reason(error)
        slab.comm.Barrier()
    return problem


def _together(path: Path, slab: Slab, parts: Sequence[Slice], places: Sequence[int], writes: bool) -> str:
    """Access the file by all ranks at once, by MPI-IO. Return the failure on this rank, or ''."""
    problem = ""
    try:
        file = MPI.File.Open(slab.comm, str(path), MPI.MODE_RDWR if writes else MPI.MODE_RDONLY)
    except MPI.Exception as error:
        return str(error)
    for part, place in zip(parts, places, strict=True):
        try:
            (file.Write_at_all if writes else file.Read_at_all)(place, part.rows)
        except MPI.Exception as error:
            problem = problem or str(error)
    try:
        file.Close()
    except MPI.Exception as error:
        problem = problem or str(error)
    return problem


# -- files laid out with places for all maps before the first is written -----------------------------------------------


def lay_out(path: Path, slab: Slab, build: Callable[[h5py.File], None], size: int, block: int = 0) -> None:
    """Create a file on root and fill it by `build(file)`. Collective.

    The file begins with `block` empty bytes. All its maps together take `size` bytes, for which the free space on disk
    and the limit on file sizes are tested first.
    """

    def make() -> None:
        try:
            with path.open("xb") as probe:
                probe.write(bytes(RESERVE))
                probe.truncate(RESERVE + size)
            with h5py.File(path, "w", userblock_size=block, locking=False) as file:
                build(file)
        except BaseException:
            path.unlink(missing_ok=True)
            raise

    write_on_root(slab, make, f"cannot create {without_mark(path)}")


def change(path: Path, slab: Slab, act: Callable[[h5py.File], None]) -> None:
    """Change attributes of fixed size on root by `act(file)`. Collective."""

    def apply() -> None:
        with h5py.File(path, "r+", locking=False) as file:
            act(file)

    write_on_root(slab, apply, f"cannot write {path}")


def put(path: Path, values: Mapping[str, NDArray[Any]]) -> None:
    """Write existing small datasets by name. Root only."""
    with h5py.File(path, "r", locking=False) as file:
        places = {name: file[name].id.get_offset() for name in values}
        types = {name: file[name].dtype for name in values}
    with path.open("r+b") as target:
        for name, numbers in values.items():
            target.seek(places[name])
            target.write(numbers.astype(types[name]).tobytes())


def save_maps(path: Path, slab: Slab, index: int, maps: Mapping[str, Array], marks: Mapping[str, float]) -> None:
    """Write the maps of one instant of a run, or of one point of a curve, and then its coordinates `marks`, such as the
    time or the velocity. Collective."""
    write_rows(
        path, slab, [Slice(name, (index,), np.ascontiguousarray(rows, np.float64)) for name, rows in maps.items()]
    )
    set_marks(path, slab, index, marks)


def set_marks(path: Path, slab: Slab, index: Any, marks: Mapping[str, Any]) -> None:
    """Set coordinates of one instant of a run or point of a curve, or of all that `index` selects. Collective. `marks`
    maps the names of the coordinates to their values; NaN means that maps are not saved there."""

    def act() -> None:
        with h5py.File(path, "r", locking=False) as file:
            axes = {name: file[name][...] for name in marks}
        for name, value in marks.items():
            axes[name][index] = value
        put(path, axes)

    write_on_root(slab, act, f"cannot write {path}")


def fixed(file: h5py.File, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> h5py.Dataset:
    """Return a new dataset with all its space allocated, so that writing does not change the structure of the file."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_layout(h5py.h5d.CONTIGUOUS)
    plist.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plist.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    plist.set_obj_track_times(False)  # files with equal data are equal
    space = h5py.h5s.create_simple(shape)
    group, _, leaf = name.rpartition("/")
    parent = file.require_group(group) if group else file
    h5py.h5d.create(parent.id, leaf.encode(), h5py.h5t.py_create(np.dtype(dtype)), space, dcpl=plist)
    return parent[leaf]


def add_coordinate(file: h5py.File, name: str, values: Array, unit: str) -> None:
    dataset = fixed(file, name, values.shape, np.float64)
    dataset[...] = values
    dataset.make_scale(name)
    dataset.attrs["units"] = unit


def add_maps(
    file: h5py.File, slab: Slab, size: tuple[float, float], units: Mapping[str, str], leading: Sequence[str]
) -> None:
    """Add the coordinates x and y [m] of a box of this `size`, and space for maps of shape (n, y, x). `units` maps the
    names of the maps to their units.

    `leading` are the names of the existing coordinates along the first axis.
    """
    for axis, length, points in zip("xy", size, (slab.nx, slab.ny), strict=True):
        add_coordinate(file, axis, np.arange(points) * (length / points), "m")
    for name, unit in units.items():
        dataset = fixed(file, name, (len(file[leading[0]]), slab.ny, slab.nx), np.float64)
        dataset.attrs["units"] = unit
        for dimension, axes in enumerate((leading, "y", "x")):
            for axis in axes:
                dataset.dims[dimension].attach_scale(file[axis])


# -- provenance --------------------------------------------------------------------------------------------------------

PROGRAM = f"parcontact {__version__}"
LIBRARIES = ("numpy", "pyfftw", "mpi4py", "h5py", "numba")
REFERENCES = Path(__file__).with_name("references.txt")  # references for the method and its parts
BUDGET = "error_budget"
LEFT_OUT = "(too long to be kept)"
WARNING_BYTES = 4_000  # tuning
BUDGET_BYTES = 1_000  # tuning
CHAIN_BYTES = 50_000  # tuning: largest text of a chain, an attribute of fixed size that can be updated [bytes]


@dataclass(frozen=True)
class Link:
    """One run in a chain of restarts: its resolved `job`, its number of `ranks`, and the step `from_step` from which it
    continued. If several runs in a row have the same job, ranks and program, one link stands for all of them, and
    `runs` is their number."""

    job: str
    ranks: int
    from_step: int = 0
    runs: int = 1
    program: str = PROGRAM
    started: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))


@dataclass(frozen=True)
class Provenance:
    """Provenance of a file of results: the `chain` of runs that wrote the file, the error `budget` so far as plain
    data, and the `references` to cite. From the job come the `seeds` of its roughness, a sentence on its `included`
    file, and its `warnings`."""

    chain: tuple[Link, ...]
    seeds: tuple[int, ...] = ()
    included: str = ""
    warnings: tuple[str, ...] = ()
    budget: Mapping[str, Any] = field(default_factory=dict)
    references: tuple[str, ...] = ()

    def write(self, file: h5py.File) -> None:
        """Write the attributes of the file: program, resolved job (YAML), chain of runs (JSON), error budget (JSON),
        ranks, seeds, libraries, references."""
        now = self.chain[-1]
        file.attrs["program"] = now.program
        file.attrs["job"] = now.job
        for name, text in self._renewable(now.job).items():
            file.attrs.create(name, text)
        file.attrs["ranks"] = now.ranks
        small = all(seed < 2**63 for seed in self.seeds)
        file.attrs["seeds"] = np.array(self.seeds, dtype=np.int64) if small else [str(seed) for seed in self.seeds]
        if self.included:
            file.attrs["included"] = self.included
        versions = {name: metadata.version(name) for name in LIBRARIES}
        versions = {"python": platform.python_version(), "hdf5": h5py.version.hdf5_version, **versions}
        file.attrs["libraries"] = json.dumps(versions)
        file.attrs["references"] = "\n".join(self.references)

    def renew(self, file: h5py.File) -> None:
        """Update the chain and other changed attributes of a file in place."""
        for name, text in self._renewable(file.attrs["job"]).items():
            if name in file.attrs:
                file.attrs.modify(name, text)

    def _renewable(self, job: str) -> dict[str, NDArray[np.bytes_]]:
        """Return the attributes of fixed size that change during a run; `job` is the job of the file."""
        texts = {
            "chain": (_chain_text(self.chain, job), CHAIN_BYTES),
            "warnings": ("\n".join(self.warnings), WARNING_BYTES),
            BUDGET: (json.dumps(self.budget), BUDGET_BYTES),
        }
        return {name: np.array(text.encode()[:size], dtype=f"S{size}") for name, (text, size) in texts.items()}


def read_budget(file: h5py.File) -> dict[str, Any]:
    """Return the error budget of the run so far: relative errors of friction and area, by source. Return {} if the file
    has none."""
    return dict(json.loads(bytes(file.attrs.get(BUDGET, b"{}"))))


def extend_chain(chain: Sequence[Link], link: Link) -> tuple[Link, ...]:
    """Return the chain with one more run. If the job, the ranks and the program are those of the last link, the number
    of runs of this link rises by 1."""
    if chain and (chain[-1].job, chain[-1].ranks, chain[-1].program) == (link.job, link.ranks, link.program):
        return (*chain[:-1], replace(chain[-1], runs=chain[-1].runs + 1))
    return (*chain, link)


def read_chain(file: h5py.File) -> tuple[Link, ...]:
    links = json.loads(bytes(file.attrs["chain"]))
    return tuple(Link(**{**link, "job": link["job"] or file.attrs["job"]}) for link in links)


def _chain_text(chain: Sequence[Link], job: str) -> str:
    """Return a chain as JSON. An empty job means the job of the file; the oldest jobs are left out if the text is too
    long."""
    links = [asdict(replace(link, job="" if link.job == job else link.job)) for link in chain]
    for link in links:
        if len(json.dumps(links)) > CHAIN_BYTES and link["job"]:
            link["job"] = LEFT_OUT
    while len(text := json.dumps(links)) > CHAIN_BYTES:
        links.pop(0)
    return text


def cite_lines(job: dict[str, Any]) -> tuple[str, ...]:
    """Return the references of a job (plain data) with their subjects, one per line."""
    return tuple(f"{reference} ({what})" for reference, what in references_of(job))


def references_of(job: dict[str, Any], features: Collection[str] = ()) -> list[tuple[str, str]]:
    """Return pairs of a reference and its subject, for a resolved job (plain data) and further `features`.

    Raises KeyError or TypeError for an incomplete job.
    """
    material, numerics = job["material"], job["numerics"]
    shift = material.get("shift", "")
    used = {
        *("", *features),
        f"kernel {numerics['kernel']}",
        f"boundary {job.get('grid', {}).get('boundary', 'periodic')}",
        f"shift {shift['law'] if isinstance(shift, dict) else shift}",
        *(
            f"shape {shape['shape']}"
            for shape in job["surface"]
            if Path(shape.get("path", "")).suffix not in OWN_FORMATS
        ),
        *(f"interface {key}" for key in job.get("interface") or {}),
    }
    bodies = [section for section in job.values() if isinstance(section, dict) and "model" in section]
    if any(body["model"] != "elastic" for body in bodies):
        used |= {"viscoelastic", f"integrator {numerics['integrator']}" if job.get("history") else ""}
    lines = REFERENCES.read_text(encoding="utf-8").splitlines()[1:]
    table = ([cell.strip() for cell in line.split("|")] for line in lines)
    return [(reference, what) for feature, reference, what in table if feature in used]
