"""The public Python interface without `Simulation`: curves, results, surfaces and materials.

* Steady sliding from Python: friction curves.
* Jobs given in Python as a file or a mapping: read on root, and sent to all ranks.
* Results of a directory, for notebooks and scripts.
* Surfaces and materials without a simulation.
* Advice in errors for Python users: arguments and keys instead of options of the command line.
"""

from __future__ import annotations

import inspect
import math
import os
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..bands.road_sliding import make_states
from ..columns import STEADY
from ..effects.branches import relaxation_of
from ..errors import Doubt, InputError, JobError, Kind, ParcontactWarning, RunError
from ..files import wisdom
from ..files.tables import Wanted
from ..job import Job, log_range
from ..job.history import Timeline
from ..march import curve, mesh, sanity
from ..march.scene import set_up
from ..march.steady import Point
from ..parallel.root import on_root, wait_for_all
from ..parallel.slab import MPI, Slab
from ..physics import prony
from ..results.results import Results

if TYPE_CHECKING:
    import xarray

NO_SWEEP = 'set={"sweep": None}'
WORDS = {  # patterns and their replacements, applied in this order
    r"choose one of them \(--case\) or leave it out \(--set sweep=null\)": f"leave it out ({NO_SWEEP})",
    r"change the sweep instead, like --set '.*'": f"leave the sweep out ({NO_SWEEP})",
    r"--set (\w+)=\{include: (.*?)\}": r'set={"\1": {"include": "\2"}}',
    r"--restart never": 'restart="never"',
    r"--restart PATH": "restart=PATH",
    r"give --out for another directory": "give another output.directory",
    r"--out\b": "output.directory",
    r"--velocities first:last:count": "velocities",
    r"--pressures": "pressures",
}


@contextmanager
def python_words() -> Iterator[None]:
    """Reword errors that are raised within the context, so that they name arguments of Python functions."""
    try:
        yield
    except (InputError, RunError) as error:
        error.args = tuple(_worded(text) if isinstance(text, str) else text for text in error.args)
        if isinstance(error, JobError):
            error.mistakes = [_worded(text) for text in error.mistakes]
        raise


def _worded(text: str) -> str:
    for pattern, words in WORDS.items():
        text = re.sub(pattern, words, text)
    return text


Given = str | os.PathLike[str] | Mapping[str, Any] | Job
SOMEWHERE = {"points": 2, "size": 1.0}  # grid of a job that needs none
ANYTHING = {"model": "elastic", "shear_modulus": 1.0e6}
A_TOUCH = [{"pressure": 1.0}]
DEEPEST = 50  # deepest nesting of mappings and lists
SHOWN = 60  # most characters of a value in a message
PACKAGE = str(Path(__file__).parents[1]) + os.sep


def read_job_here(given: Given, changes: Mapping[str, Any] | None = None, comm: MPI.Intracomm | None = None) -> Job:
    """Return the job of a file or mapping with changed keys, on every rank of `comm`; collective.

    Raises JobError for mistakes in the job, or if ranks give different jobs, and InputError for a run that cannot
    begin.
    """
    world = all_ranks(comm)
    agree(world, given, changes)
    made: list[Job] = []

    def load() -> Job:
        made.append(_sound(given if isinstance(given, Job) else mesh.load(given, changes or {})))
        return made[0]

    with python_words():
        sent = on_root(world, load)
    return made[0] if made else sent  # only root's job has arrays of heights


def _sound(job: Job) -> Job:
    sanity.refuse_impossible(job, Timeline.from_job(job))
    return job


def all_ranks(comm: MPI.Intracomm | None) -> MPI.Intracomm:
    """Return the communicator (default: all ranks). Raises InputError for other objects."""
    if comm is not None and not isinstance(comm, MPI.Intracomm):
        raise InputError(f"comm must be a communicator of mpi4py, got {comm!r:.60}")
    return MPI.COMM_WORLD if comm is None else comm


def agree(comm: MPI.Intracomm, given: object, changes: object = None) -> None:
    """Raise JobError unless all ranks give the same job; collective."""
    if comm.size == 1:
        return
    wait_for_all(comm, "gives a job")
    own = dict([*_flat(given, ""), *_flat(changes, "set")])
    if len(set(comm.allgather(blake2b(repr(own).encode(errors="replace"), digest_size=16).digest()))) == 1:
        return
    everyone = comm.allgather(own)
    for rank, other in enumerate(everyone):
        for key in sorted({*everyone[0], *other}):
            first, here = (values.get(key, "not there") for values in (everyone[0], other))
            if first != here:
                text = f"{key or 'the job'} is {first:.{SHOWN}} on rank 0 and {here:.{SHOWN}} on rank {rank}"
                raise JobError([f"ranks give different jobs: {text}; give all of them the same"])


def _flat(value: Any, key: str, depth: int = 0) -> Iterator[tuple[str, str]]:
    """Yield key and value of all values of a job as text."""
    if isinstance(value, Job):
        value = value.resolved()
    if isinstance(value, np.ndarray) and value.dtype != object:
        digest = blake2b(np.ascontiguousarray(value).tobytes(), digest_size=8).hexdigest()
        yield key, f"an array of shape {value.shape} and checksum {digest}"
    elif isinstance(value, Mapping | list | tuple) and len(value) > 0 and depth < DEEPEST:
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        for name, item in items:
            yield from _flat(item, f"{key}.{name}" if key else str(name), depth + 1)
    elif isinstance(value, os.PathLike):
        yield key, repr(os.fspath(value))
    else:
        value = value.item() if isinstance(value, np.generic) else value
        known = isinstance(value, str | int | float | range | None)
        yield key, repr(value) if known else f"of type {type(value).__name__}"


def path_of(path: object) -> Path:
    """Return a path. Raises InputError for other objects."""
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"a path must be a text or a pathlib.Path, got {path!r:.60}")
    try:
        usable = b"\0" not in os.fsencode(path)
    except UnicodeEncodeError:
        usable = False
    if not usable:
        raise InputError(f"a path must be a name that the file system can store, got {path!r:.60}")
    return Path(os.fsdecode(path))


def of_parts(**parts: Any) -> Job:
    """Return a job that has the given sections and defaults for the others; it is made on this rank only. Raises
    JobError for mistakes."""
    rest = {"grid": SOMEWHERE, "surface": {"shape": "flat"}, "material": ANYTHING, "history": A_TOUCH}
    return _sound(mesh.load(rest | parts))


def warn(doubt: Doubt) -> None:
    """Issue a warning at the line of the user's script that called this package."""
    level, frame = 1, inspect.currentframe()
    while frame is not None and frame.f_code.co_filename.startswith(PACKAGE):
        level, frame = level + 1, frame.f_back
    warnings.warn(ParcontactWarning(doubt), stacklevel=level)


Array = NDArray[np.float64]
Values = str | float | Sequence[float] | Array | None


@dataclass(frozen=True)
class Curve:
    """A friction curve: arrays of shape (points,), for each temperature all velocities under each pressure.

    `velocity` [m/s], `pressure` [Pa, mean], `friction` [-, dissipated power divided by load and velocity, plus
    interface friction], `friction_slopes` [-, by the slopes of the rigid surface], `error_friction`, `error_area` [-,
    relative errors of friction and of the corrected area], `contact_area`, `contact_area_corrected` [share of the
    nominal area, counted and corrected at edges], `force_x`, `force_y` [N, on the rigid surface], `approach`,
    `mean_gap` [m], `max_pressure` [Pa], `residual` [-, of the solve]; `power` [W, shape (points, branches), dissipated
    by each branch; no branches for a free box]; `temperature` [deg C, NaN if not requested], `shift_factor` [-,
    relaxation times divided by those at the reference temperature]; `flash_temperature`, `max_temperature` [K, mean
    rise in the contact and highest rise; NaN without `thermal`], `error_flash` [-, relative error of the mean rise].

    Points that could not be solved are NaN, with the reason in `failures`.
    """

    velocity: Array
    pressure: Array
    friction: Array
    friction_slopes: Array
    error_friction: Array
    error_area: Array
    contact_area: Array
    contact_area_corrected: Array
    force_x: Array
    force_y: Array
    approach: Array
    mean_gap: Array
    max_pressure: Array
    residual: Array
    power: Array
    temperature: Array
    shift_factor: Array
    flash_temperature: Array
    max_temperature: Array
    error_flash: Array
    failures: tuple[str, ...] = ()


WARN_UNSOLVED_POINT = Kind("unsolved point", "{where}")


def steady(
    job: Given,
    velocities: Values = None,
    pressures: Values = None,
    temperatures: Values = None,
    set: Mapping[str, Any] | None = None,
    comm: MPI.Intracomm | None = None,
) -> Curve:
    """Solve steady sliding at velocities [m/s] under mean pressures [Pa], and return the curve on every rank;
    collective.

    `job` and `set` are those of `Simulation`. Velocities and pressures are lists, or texts `first:last:count` for
    numbers equally spaced in the logarithm. Without these arguments, the velocities and pressures of the job's `steady`
    section are taken. If that section gives no pressures, the pressure of the first stage under a load is taken.
    `temperatures` [deg C] is a list, for a material with a shift (default: the `steady` section). Nothing is written.

    Raises JobError, and InputError for missing velocities or pressures. Failed points and implausible values give a
    ParcontactWarning on root.
    """
    asked = {
        "velocities": _numbers("velocities", velocities),
        "pressures": _numbers("pressures", pressures),
        "temperatures": _numbers("temperatures", temperatures, ranges=False),
    }
    keys = {f"steady.{name}": list(values) for name, values in asked.items() if values}  # the job needs no history
    found = read_job_here(job, {**set, **keys} if isinstance(set, Mapping) else set or keys, comm)
    slab = Slab(all_ranks(comm), *found.grid.points)
    with python_words():
        wanted = curve.request(found, *asked.values())
    wisdom.recall(curve.transforms_of(found), slab, None)
    sliding = make_states(found, slab)
    for doubt in sliding.doubts(wanted.temperatures):
        if slab.root:
            warn(doubt)
    contacts = curve.watch_contacts(sliding.setup, found)
    points: list[Point | None] = []
    failures: list[str] = []
    doubts: list[Doubt] = []
    for at in wanted.points:
        point = None
        try:
            point = curve.solve_point(sliding, wanted, at)
        except RunError as error:
            failures.append(str(error))
            doubts.append(WARN_UNSOLVED_POINT("", {"where": str(error)}))
        sliding.forget()
        points.append(point)
        doubts += contacts.check_point(point.measures, str(at)) if point else []
    solved = [point for point in points if point]
    for doubt in (*doubts, *curve.doubt_points(solved, found)) if slab.root else ():
        warn(doubt)
    return _curve(wanted.points, points, tuple(failures))


def _curve(wanted: Sequence[Wanted], points: Sequence[Point | None], failures: tuple[str, ...]) -> Curve:
    """Return the columns of steady.csv as arrays; failed points have their requested coordinates."""
    places = {"velocity": "speed", "pressure": "pressure", "temperature": "temperature"}
    found = {name: np.array([getattr(at, place) for at in wanted]) for name, place in places.items()}
    wanted_names = {each.name for each in fields(Curve)} - {*places, "power", "failures"}
    for column in (column for column in STEADY if column.name in wanted_names):
        values = [math.nan if point is None else float(column.value(point)) for point in points]
        found[column.name] = np.array(values)
    branches = max((len(point.dissipated) for point in points if point), default=0)
    power = np.array([(math.nan,) * branches if point is None else point.dissipated for point in points])
    return Curve(**found, power=power, failures=failures)


def _numbers(name: str, values: Values, ranges: bool = True) -> tuple[float, ...]:
    if values is None:
        return ()
    try:
        if isinstance(values, str) and ranges:
            return log_range(values)
        if not isinstance(values, str) and not np.iscomplexobj(values):
            return tuple(float(value) for value in np.ravel(values))
    except (TypeError, ValueError):
        pass
    also = " or a range first:last:count" if ranges else ""
    raise JobError([f"{name} must be a number, a list of numbers{also}, got {values!r:.60}"])


def open(directory: str | os.PathLike[str]) -> xarray.Dataset:
    """Return the results of a run, which may still be running, as an xarray dataset.

    The columns of measures.csv are variables along `step`, with the coordinate `time` [s]. Maps of fields.h5 are the
    variables `pressure_map`, `gap_map`, ..., of shape (t, y, x), with the coordinates `t` [s] and `map_step`; they are
    read when they are used. `friction.sel(step=map_step)` is the friction of each map. Variables have `units`, `1` if
    dimensionless; columns of other packages' effects have none. Values that were not requested are NaN. Raises
    InputError for a directory without results, ImportError without xarray.
    """
    run = Results(path_of(directory), "run")
    if "run" not in run.kinds:
        raise InputError(f"{run.path} has no measures.csv: it is not the output directory of a run")
    return run.dataset


Surface = Mapping[str, Any] | NDArray[Any] | Sequence[Mapping[str, Any] | NDArray[Any]]


def surface(surface: Surface, grid: Mapping[str, Any]) -> Array:
    """Return the heights [m] of a job's `surface` on its `grid`, shape (ny, nx), positive into the body.

    The surface may be an array. Works on this rank only. Raises JobError for mistakes, InputError for files that do not
    match.
    """
    job = of_parts(surface=surface, grid=grid)
    base = set_up(job, Slab.alone(*job.grid.points))
    heights = base.surface.heights((0.0, 0.0), base.slab.empty())
    return np.asarray(heights * base.units.height + base.surface.datum)


def material(material: Mapping[str, Any]) -> Material:
    """Return the material that a job's section describes. Raises JobError for mistakes."""
    job = of_parts(material=material)
    spring, moduli, times = relaxation_of(job.material)
    return Material(spring, tuple(moduli.tolist()), tuple(times.tolist()), job.material.poisson)


@dataclass(frozen=True)
class Material:
    """A linear viscoelastic material, `G(t) = modulus_inf + sum moduli exp(-t/relaxation_times)` [Pa, s].

    All moduli are shear moduli; `poisson` is constant in time.
    """

    modulus_inf: float
    moduli: tuple[float, ...]
    relaxation_times: tuple[float, ...]
    poisson: float

    def complex_modulus(self, omega: ArrayLike) -> NDArray[np.complex128]:
        """Return storage and loss modulus [Pa] as real and imaginary part at angular frequencies [rad/s] of any
        shape."""
        return prony.complex_modulus(omega, *self._series)

    def relaxation(self, t: ArrayLike) -> Array:
        """Return the relaxation modulus G(t) [Pa] at times t >= 0 [s] of any shape."""
        return prony.relaxation(t, *self._series)

    def creep(self, t: ArrayLike) -> Array:
        """Return the creep compliance J(t) [1/Pa] at times t >= 0 [s] of any shape."""
        return prony.creep(t, *self._series)

    @property
    def _series(self) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
        return self.modulus_inf, self.moduli, self.relaxation_times
