"""The public class `Simulation`.

* `Simulation` runs a job in this process, step by step, with access to its fields and state.
* `Row` has the measures of a step, by the names of columns of measures.csv.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NoReturn

from ..columns import cells
from ..effects.effect import columns_of
from ..errors import Doubt, InputError
from ..files import checkpoint, recorder, run, wisdom
from ..files.checkpoint import Contents, Facts, TableMark
from ..files.fields import UNITS
from ..files.stopping import Options
from ..job import Job
from ..job.listing import plain_job
from ..job.yaml_text import parse
from ..march import sanity, steady
from ..march.choices import choices
from ..march.loop import March
from ..march.sanity import ContactWatch
from ..parallel.root import on_root, wait_for_all
from ..parallel.slab import MPI, Array, Slab
from .python import Given, agree, all_ranks, path_of, python_words, read_job_here, warn


class Row(Mapping[str, float]):
    """Measures of an instant: `row.friction` and `row["friction"]` are the column of measures.csv, in the same unit.

    Energies [J] that the job does not request (`output.energy`) are NaN. `dict(row)` has all columns. Type checkers
    know the columns of the page `outputs` as attributes, but neither columns of single branches, such as
    `row["dissipated_0"]`, nor columns of effects of other packages. A column that the job does not have raises
    AttributeError.
    """

    step: int
    time: float
    distance: float
    pressure: float
    force_x: float
    force_y: float
    friction: float
    contact_area: float
    approach: float
    mean_gap: float
    max_pressure: float
    iterations: int
    residual: float
    penetration: float
    operator_calls: int
    work: float
    stored: float
    dissipated: float
    seconds: float
    friction_x: float
    contact_area_corrected: float
    error_friction: float
    error_area: float
    error_gap: float
    error_energy: float
    cut_off: int
    friction_viscous: float
    friction_interface: float
    flow_x: float
    flow_y: float
    constriction: float
    high_pressure: float
    low_pressure: float
    fluid_pressure: float
    flow_rate: float
    mass_flow: float
    error_x: float
    error_leak: float
    error_rounds: float
    rounds: float
    stick_area: float
    slip_loss: float
    tensile_area: float
    adhesive_force: float
    surface_energy: float
    snap_loss: float
    flash_temperature: float
    max_temperature: float
    error_flash: float

    def __init__(self, numbers: Mapping[str, float]) -> None:
        self._numbers = dict(numbers)

    def __getitem__(self, name: str) -> float:
        return self._numbers[name]

    if not TYPE_CHECKING:  # type checkers must not accept misspelt columns

        def __getattr__(self, name: str) -> Any:
            known = self.__dict__.get("_numbers", {})
            if name not in known:
                raise AttributeError(f"measures have no {name!r}; known names:  {', '.join(known)}")
            return known[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._numbers]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)

    def __repr__(self) -> str:
        return f"Row({', '.join(f'{name}={value:.6g}' for name, value in self._numbers.items())})"


class Simulation:
    """A job, run from Python on the ranks of `comm`; all methods are collective.

    Parameters: `job`, the path of a job file or a mapping with the same keys; `set`, values by keys like `grid.points`
    that replace values of the job; `comm`, an MPI communicator (default: all ranks). Raises JobError for a job with
    mistakes, and InputError for files that do not match the job. Implausible values give a ParcontactWarning on root.

    Files are written by `run` only, and only if the job, or `set`, gives `output.directory`. Paths in a mapping are
    relative to the working directory.
    """

    def __init__(self, job: Given, set: Mapping[str, Any] | None = None, comm: MPI.Intracomm | None = None) -> None:
        self.comm = all_ranks(comm)
        self.job = read_job_here(job, set, self.comm)
        if not self.job.history:
            raise InputError("the job has no history to run; parcontact.steady solves its steady states")
        if self.job.bands is not None:
            raise InputError(
                "a job in bands has no steps in memory, as its rows exist when the coarsest band is done: run it by "
                "`parcontact job.yaml`, and read its results by parcontact.open"
            )
        self._slab = Slab(self.comm, *self.job.grid.points)
        self._saved: Contents | None = None
        self._march_made: March | None = None
        self._began = False  # True after the row of the initial state was yielded
        self._stepped = False  # True after steps in memory

    # -- running ------------------------------------------------------------------------------------------------------

    def steps(self) -> Iterator[Row]:
        """Yield the row of the initial state, and then the row of each step. Each step is made on demand, in memory.

        A second call continues after the last step. Raises RunError for a failed step, and keeps the state before it.
        All ranks must make each step: if one rank leaves the loop by `break` or an exception, the others raise
        RunError.
        """
        march, self._stepped = self._march, True
        timeline = march.timeline()
        if not self._began:
            self._began = True
            yield self.row
        steps = march.steps(timeline)
        while True:
            self._wait_for_all(f"makes step {march.row.step + 1}")
            if (step := next(steps, None)) is None:
                return
            march.advance(step)
            if march.detached:
                return
            for doubt in self._contacts.check_step(march.row.step, march.row.measures):
                self._warns(doubt)
            yield self.row

    def run(self, restart: str | os.PathLike[str] = "auto", quiet: bool = True) -> Row:
        """Run to the end of the history; returns the last row.

        A job with an output directory runs as on the command line: from the newest checkpoint, from the beginning
        (`restart="never"`), or from the path of a checkpoint; `quiet=False` prints a line per step. A signal or a stop
        file may stop the run early (see `finished`). A second call continues the run. Raises RunError for a failed
        step, InputError for a foreign directory.
        """
        if not self.job.origin.names_directory:
            for _ in self.steps():
                pass
            return self.row
        if self._stepped:
            raise InputError("run() writes the files of a whole run: it must come before the first of steps()")
        self._wait_for_all("runs")
        at = str(self._saved.path if self._saved is not None else path_of(restart))
        with _in_a_file(self.job, self._slab) as job, python_words():
            ended = run.run_to_end(job, self._slab, Options(quiet, at, shows=self._warns))
        if ended.march is None and ended.contents is None:
            raise InputError(f"{self.job.output.directory} has a finished run without a checkpoint")
        self._march_made, self._saved, self._began = ended.march, ended.contents, True
        self.__dict__.pop("_contacts", None)  # belongs to the previous march
        return self.row

    @property
    def row(self) -> Row:
        """Return the measures of the last step, or of the initial state before the first step. After `restore` it is
        the row of the last step before the checkpoint."""
        march, saved = self._march, self._saved
        added = columns_of(march.scene.effects)
        if saved is not None and saved.table.last and march.row.step == saved.step:
            numbers = [int(cell) if cell.isdecimal() else float(cell or "nan") for cell in saved.table.last.split(",")]
        else:
            numbers = recorder.row_numbers(march.row, len(march.row.branch_dissipation))
        names = recorder.columns(len(numbers) - len(recorder.columns(0, added)), added)
        return Row(dict(zip(names, numbers, strict=True)))

    @property
    def finished(self) -> bool:
        """Return True if all steps are made, or if the surfaces have detached for good under their load."""
        return bool(self.detached) or self._march.row.step >= len(self._march.timeline())

    @property
    def detached(self) -> str:
        """Return when and why the surfaces detached for good under their load; '' if they did not."""
        return self._march.detached

    @property
    def errors(self) -> dict[str, dict[str, float]]:
        """Return the known estimated relative errors so far, as printed at the end of a run: of `friction` and
        `contact_area_corrected`, by source and in total (`total`). The rows of `steps` have the errors of their
        instants."""
        return {name: dict(parts) for name, parts in self._march.state.errors.facts(None).items() if name != "accuracy"}

    # -- fields -------------------------------------------------------------------------------------------------------

    @property
    def rows(self) -> slice:
        """Return the slice of a map's first axis (y) that is on this rank."""
        return self._slab.rows

    def field(self, name: str) -> Array:
        """Return this rank's rows of a map as a new array, shape (ny_loc, nx): `pressure` [Pa], `displacement` [m] of
        the body, `height` [m] of the rigid surface in its present position, or `gap` [m] between body and surface.

        Raises InputError for another name.
        """
        if name not in UNITS:
            raise InputError(f"there is no field {name!r}; known fields: {', '.join(UNITS)}")
        self._wait_for_all(f"takes the map {name}")
        return self._march.field(name)

    def gather(self, name: str) -> Array | None:
        """Return the whole map, shape (ny, nx), on root, None on other ranks; units and errors as for `field`."""
        return self._slab.to_root(self.field(name))

    # -- state --------------------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a checkpoint for `restore` and `parcontact --restart PATH`, on any number of ranks.

        Heights given as an array are written into the same directory. Raises RunError if this fails, InputError for a
        wrong path.
        """
        file, march, slab = path_of(path), self._march, self._slab
        if on_root(self.comm, lambda: os.path.isdir(file)):
            raise InputError(f"{file} is a directory: give the name of a file in it")
        self._wait_for_all(f"saves {file}")
        plain = on_root(self.comm, lambda: plain_job(self.job))
        last = ",".join(cells(self.row.values()))
        provenance = run.provenance_of(self.job, slab, self._saved)
        checkpoint.store(self.job.surface, file.parent, slab)
        march.save(file, Facts(plain, provenance, table=TableMark(last=last)))

    @classmethod
    def restore(
        cls, path: str | os.PathLike[str], set: Mapping[str, Any] | None = None, comm: MPI.Intracomm | None = None
    ) -> Simulation:
        """Return a simulation that continues from a checkpoint, in memory unless `set` gives `output.directory`.

        `set` may change the future (later stages, tolerances), not the past. Raises InputError for a damaged or foreign
        file.
        """
        world, file = all_ranks(comm), path_of(path)
        agree(world, file, set)
        text = on_root(world, lambda: checkpoint.inspect(file).chain[-1].job)
        elsewhere = "surface" in str(set)
        job = read_job_here(
            on_root(world, lambda: checkpoint.located(parse(text, str(file)).data, file, elsewhere)), set, world
        )
        if not any(key.startswith("output") for key in set or {}):  # keys were checked by reading the job
            job = job.with_origin(job.origin._replace(names_directory=False))
        simulation = cls(job, comm=world)
        slab = simulation._slab
        plain = on_root(world, lambda: plain_job(job))
        with python_words():
            found = run.sound_checkpoint(file, job, plain, slab)
            if isinstance(found, str):
                raise InputError(found)
        simulation._saved, simulation._began = found, True
        return simulation

    @property
    def _march(self) -> March:
        """Return the march, created on first use."""
        if self._march_made is None:
            self._wait_for_all("begins")
            saved = self._saved
            wisdom.recall(choices(self.job).transforms, self._slab, saved.numbers.get("plans/all") if saved else None)
            with python_words():
                self._march_made = steady.first(self.job, self._slab, saved=saved)
            for doubt in sanity.find_doubts(self._march_made.scene.setup):
                self._warns(doubt)
        return self._march_made

    @cached_property
    def _contacts(self) -> ContactWatch:
        """Return the watch that warns about implausible contacts."""
        return ContactWatch.of(self.job, self._march.timeline())

    def _warns(self, doubt: Doubt) -> bool:
        """Issue a warning on root."""
        if self._slab.root:
            warn(doubt)
        return False

    def _wait_for_all(self, what: str) -> None:
        """Wait until all ranks do `what`; collective. Raises RunError if a rank does something else or has ended."""
        wait_for_all(self.comm, f"{what} of {self!r}")

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Simulation cannot be pickled or copied: it belongs to the ranks of this process;  "
            "use save(path) and Simulation.restore(path)"
        )

    def __repr__(self) -> str:
        grid = self.job.grid
        return f"<Simulation of {self.job.title or self.job.path.stem!r}: {grid.nx} x {grid.ny} points>"


@contextmanager
def _in_a_file(job: Job, slab: Slab) -> Iterator[Job]:
    """Yield a job that has a file; a mapping is written to a temporary one; collective."""
    if job.origin.from_file:
        yield job
        return
    with TemporaryDirectory() as directory:
        path = Path(directory, "job.yaml")
        if slab.root:
            path.write_text(job.resolved())
        yield job.with_origin(job.origin._replace(path=path))
