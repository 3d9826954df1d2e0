"""A job in this process: its steps one by one, its fields, its state."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NoReturn

from ..columns import cells
from ..doubts import Doubt
from ..effects.effect import columns_of
from ..errors import InputError
from ..job import Job
from ..job.checks.cells import more_points
from ..job.sections.listing import plain_job
from ..job.text.yamltext import parse
from ..march.loop import March
from ..parallel.lockstep import wait_for_all
from ..parallel.mpi import MPI
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab
from ..run import restart, runner
from ..run.run import Options
from ..scene import choices
from ..scene.sanity import ContactWatch
from ..steady_sliding import start
from ..storage import checkpoint, heights, wisdom
from ..storage.checkpoint import Contents, Facts, TableMark
from ..storage.fields import UNITS
from .given_jobs import Given, agree, all_ranks, path_of, read_job_here, warn, warn_of
from .row import Row
from .wording import python_words


class Simulation:
    """A job, run from Python on the ranks of `comm`; every method is collective.

    Parameters: `job`, the path of a job file or a mapping like one; `set`, values by keys like `grid.points` that
    replace those of the job; `comm`, an MPI communicator (default: all ranks). Raises JobError for a job with
    mistakes, InputError for files that do not fit it; warns (ParcontactWarning, on root) of what is allowed
    but means little.

    Nothing is written unless the job, or `set`, names `output.directory`, and then only by `run`. Files that a mapping
    names are looked for from the working directory.
    """

    def __init__(self, job: Given, set: Mapping[str, Any] | None = None, comm: MPI.Intracomm | None = None) -> None:
        self.comm = all_ranks(comm)
        self.job = read_job_here(job, set, self.comm)
        if not self.job.history:
            raise InputError("the job has no history to run; parcontact.steady solves its steady states")
        self._slab = Slab(self.comm, *self.job.grid.points)
        self._saved: Contents | None = None
        self._march_made: March | None = None
        self._began = False  # whether the row of the initial state has been handed out
        self._stepped = False  # whether steps are made in memory

    # -- running ------------------------------------------------------------------------------------------------------

    def steps(self) -> Iterator[Row]:
        """Yield the row of the initial state, then one after each step, made when it is asked for; in memory.

        Called again it goes on after the last step made. Raises RunError for a step that could not be made; the state
        is then that before it. All ranks make each step: one that leaves the loop, by `break` or an exception of its
        own, makes the others raise RunError.
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
        """Go on to the end of the history; the last row.

        A job that names an output directory runs as on the command line, with the files that it asks for: from the
        newest checkpoint there, afresh (`restart="never"`), or from a checkpoint by its path; `quiet=False` prints a
        line per step. It may stop early, when a signal or a stop file asks for it: see `finished`; called again it goes
        on. Raises RunError for a step that could not be made, InputError for a directory that is not its own.
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
            ended = runner.run_to_end(job, self._slab, Options(quiet, at, shows=self._warns))
        if ended.march is None and ended.contents is None:
            raise InputError(f"{self.job.output.directory} holds a run that has finished, and none of its states")
        self._march_made, self._saved, self._began = ended.march, ended.contents, True
        self.__dict__.pop("_contacts", None)  # of the march before
        return self.row

    @property
    def row(self) -> Row:
        """The measures of the last step, also one before a restart; of the initial state before the first."""
        march, saved = self._march, self._saved
        added = columns_of(march.scene.effects)
        if saved is not None and saved.table.last and march.row.step == saved.step:
            return Row.from_line(saved.table.last, added)
        return Row.from_record(march.row, added)

    @property
    def finished(self) -> bool:
        """Whether all steps of the history are made, or surfaces that stick have come off under their load."""
        return bool(self.detached) or self._march.row.step >= len(self._march.timeline())

    @property
    def detached(self) -> str:
        """When and why surfaces that stick have come off under their load, which ends the history; empty otherwise."""
        return self._march.detached

    @property
    def errors(self) -> dict[str, dict[str, float]]:
        """Estimated relative errors so far, which the end of a run says: of `friction` and `contact_area_corrected`, as
        far as they are known, by what makes them and in all (`total`). Rows have those of their instant."""
        return {name: dict(parts) for name, parts in self._march.state.errors.facts(None).items() if name != "accuracy"}

    # -- fields -------------------------------------------------------------------------------------------------------

    @property
    def rows(self) -> slice:
        """The rows of a map (along y) that this rank has."""
        return self._slab.rows

    def field(self, name: str) -> Array:
        """Return this rank's rows of a map, shape (ny_loc, nx), a new array: `pressure` [Pa], `displacement` [m] of the
        body, `height` [m] of the rigid surface where it is now, or `gap` [m] between both.

        Raises InputError for another name.
        """
        if name not in UNITS:
            raise InputError(f"there is no field {name!r}; there are {', '.join(UNITS)}")
        self._wait_for_all(f"takes the map {name}")
        return self._march.field(name)

    def gather(self, name: str) -> Array | None:
        """Return the whole map, shape (ny, nx), on root; None on the other ranks. Units and errors as for `field`."""
        return self._slab.to_root(self.field(name))

    # -- state --------------------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a checkpoint, which `restore` and `parcontact --restart PATH` go on from, on any number of ranks.

        Heights that are an array are written beside it. Raises RunError where that cannot be, InputError for what is no
        path.
        """
        file, march, slab = path_of(path), self._march, self._slab
        self._wait_for_all(f"saves {file}")
        plain = on_root(self.comm, lambda: plain_job(self.job))
        last = ",".join(cells(self.row.values()))
        provenance = runner.provenance_of(self.job, slab, self._saved)
        heights.store(self.job.surface, file.parent, slab)
        march.save(file, Facts(plain, provenance, table=TableMark(last=last)))

    @classmethod
    def restore(
        cls, path: str | os.PathLike[str], set: Mapping[str, Any] | None = None, comm: MPI.Intracomm | None = None
    ) -> Simulation:
        """Go on from a checkpoint, in memory unless `set` names `output.directory`.

        `set` may change what is to come (the stages ahead, tolerances), not what has been. Raises InputError for a
        file that is no sound checkpoint, or not of such a job.
        """
        world, file = all_ranks(comm), path_of(path)
        agree(world, file, set)
        text = on_root(world, lambda: checkpoint.inspect(file).chain[-1].job)
        elsewhere = "surface" in str(set)
        job = read_job_here(
            on_root(world, lambda: heights.located(parse(text, str(file)).data, file, elsewhere)), set, world
        )
        if not any(key.startswith("output") for key in set or {}):  # `read` has found its keys to be words
            job = job.with_origin(job.origin._replace(names_directory=False))
        simulation = cls(job, comm=world)
        slab = simulation._slab
        plain = on_root(world, lambda: plain_job(job))
        with python_words():
            found = restart.sound(file, job, plain, slab)
            if isinstance(found, str):
                raise InputError(found)
        simulation._saved, simulation._began = found, True
        return simulation

    @property
    def _march(self) -> March:
        """The march, made when it is first asked for."""
        if self._march_made is None:
            self._wait_for_all("begins")
            saved = self._saved
            wisdom.recall(choices(self.job).transforms, self._slab, saved.numbers.get("plans/all") if saved else None)
            with python_words():
                self._march_made = start.first(self.job, self._slab, saved=saved)
            warn_of(self._march_made.scene.setup)
        return self._march_made

    @cached_property
    def _contacts(self) -> ContactWatch:
        """Return the watch that warns of contacts which mean little."""
        return ContactWatch(self.job.numerics.strict, self._march.timeline(), more=more_points(self.job.grid))

    def _warns(self, doubt: Doubt) -> bool:
        """Warn, on root, in the place of whoever would show the doubt."""
        if self._slab.root:
            warn(doubt)
        return False

    def _wait_for_all(self, what: str) -> None:
        """Wait for all ranks to do `what`; collective. Raises RunError if one does something else or has ended."""
        wait_for_all(self.comm, f"{what} of {self!r}")

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Simulation cannot be pickled or copied: it belongs to the memory and the ranks of this process; "
            "save(path) keeps it, and Simulation.restore(path) makes another one of that"
        )

    def __repr__(self) -> str:
        grid = self.job.grid
        return f"<Simulation of {self.job.title or self.job.path.stem!r}: {grid.nx} x {grid.ny} points>"


@contextmanager
def _in_a_file(job: Job, slab: Slab) -> Iterator[Job]:
    """Give a job a file, if only for a moment: a mapping is written to one; collective."""
    if job.origin.from_file:
        yield job
        return
    with TemporaryDirectory() as directory:
        path = Path(directory, "job.yaml")
        if slab.root:
            path.write_text(job.resolved())
        yield job.with_origin(job.origin._replace(path=path))
