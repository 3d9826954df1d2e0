"""Rows and maps of a run while it goes on, in files and in a terminal.

* measures.csv and its columns: root writes a row for the initial state and one for each step.
* The console and run.log: root prints a line for each step, messages and warnings, and on a terminal a progress bar.
* The first lines of run.log: facts about the machine and the program, for diagnosis.
* The growing files of a run: run.log, measures.csv and fields.h5, which are begun or continued.
"""

import math
import os
import platform
import re
import shlex
import socket
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import TextIO

from tqdm import tqdm

from ..capabilities import Column
from ..columns import MEASURES, cells, choose_columns, names_of, values_of
from ..errors import InputError, RunError
from ..march.budget import ErrorBudget
from ..parallel.slab import MPI, Array
from ..physics.records import Certificate, Measures
from ..printed import printable
from . import fields, files, hdf5, outputs
from .checkpoint import Contents, TableMark
from .fields import FieldsFile
from .hdf5 import PROGRAM, Provenance
from .outputs import Directory
from .tables import MEND, GrowingTable, whole_lines


@dataclass(frozen=True)
class StepRow:
    """Record of one instant of a run, a row of measures.csv. Values are in SI units. Energies count from the start of
    the run.

    `errors` is the error budget of the instant, None if nothing is in contact. `added` are the values of the columns of
    effects. `remark` is a sentence for run.log about an unusual step, or ''.
    """

    step: int = 0
    time: float = 0.0
    distance: float = 0.0
    measures: Measures = field(default_factory=Measures)
    iterations: int = 0
    certificate: Certificate = field(default_factory=lambda: Certificate(0.0, 0.0, 0.0))
    operator_calls: int = 0
    work: float = math.nan
    stored: float = math.nan
    dissipated: float = math.nan
    error_energy: float = math.nan
    branch_dissipation: tuple[float, ...] = ()
    seconds: float = 0.0
    remark: str = ""
    errors: ErrorBudget | None = None
    added: tuple[float, ...] = ()

    @property
    def error_friction(self) -> float:
        """Return the estimated relative error of friction. It is 1 or more if friction may be 0, and NaN if it is
        unknown."""
        return self.errors.friction.of_friction if self.errors and self.errors.friction else math.nan

    @property
    def error_area(self) -> float:
        """Return the estimated relative error of the contact area, or NaN if it is unknown."""
        return self.errors.area.total if self.errors else math.nan

    @property
    def error_gap(self) -> float:
        """Return the estimated relative error of the mean gap. This is the relative error of the share of the surface
        that is open; in a free box `Measures.gap_by_edges` is added. Return NaN in full contact, or if the error is
        unknown."""
        area, gap = self.measures.contact_area_corrected, self.measures.mean_gap
        by_edges = self.measures.gap_by_edges / gap if gap > 0.0 else 0.0
        return self.error_area * area / (1.0 - area) + by_edges if area < 1.0 else math.nan


def columns(branches: int, added: Sequence[str] = ()) -> list[str]:
    """Return the columns of measures.csv, with the dissipation of `branches` and columns `added` by effects.

    Raises InputError for a repeated name.
    """
    names = [*names_of(_always(branches)), *added]
    if twice := {name for name in added if names.count(name) > 1}:
        raise InputError(f"measures.csv has a column {', '.join(sorted(twice))}: its effect must give it another name")
    return names


def row_numbers(row: StepRow, branches: int) -> list[float]:
    """Return the values of a row in the order of `columns`. Energies that the job does not request are NaN."""
    return [*values_of(_always(branches), row), *row.added]


@cache
def _always(branches: int) -> list[Column]:
    return choose_columns(MEASURES, branches)


class MeasuresFile(GrowingTable):
    """The growing measures.csv of a run; `table` is its present state."""

    def __init__(self, path: Path, table: TableMark, branches: int = 0, added: Sequence[str] = ()) -> None:
        """Continue the file with the state `table`, or begin it."""
        super().__init__(path, columns(branches, added))
        self.table, self._branches = table, branches

    def write(self, row: StepRow) -> None:
        """Append a row. If writing fails, the file is unchanged, but `table` includes the row. So the next checkpoint
        holds the row, and the run that continues from it adds the row to the file."""
        line = cells(row_numbers(row, self._branches))
        self.table = TableMark(self.table.rows + 1, ",".join(line))
        self.append(line)


def cut_back_table(
    path: Path, step: int, then: TableMark, branches: int = 0, added: Sequence[str] = ()
) -> tuple[TableMark, list[str]]:
    """Remove rows after `step`, and an incomplete row, and change the columns to those of the present job.

    `then` is the table's state when the checkpoint was written: its last row is added if it is missing because the disk
    was full. Return the new state and messages on lost rows. Raises InputError for a damaged file, which is not
    changed.
    """
    if not path.exists():
        return TableMark(), [f"{path} is missing: the rows up to step {step} are lost"]
    found, wanted = whole_lines(path), columns(branches, added)
    names = next(found, [])
    if "step" not in names:
        raise InputError(f"{path}, line 1, must name the columns, including step; correct it, or move the file away")
    last, kept, problems = -1, TableMark(), list[str]()
    with files.replaced(path) as new:
        new.write(f"{','.join(wanted)}\n".encode())
        for number, line in enumerate(found, 2):
            row = dict(zip(names, line, strict=True))
            if not row["step"].isdecimal():
                raise InputError(f"{path}, line {number}: the step {row['step']!r} is not a whole number; {MEND}")
            if int(row["step"]) > step:
                break
            last, kept = int(row["step"]), TableMark(kept.rows + 1, ",".join(row.get(name, "") for name in wanted))
            new.write(f"{kept.last}\n".encode())
        if last < step and kept.rows + 1 == then.rows and names == wanted:
            kept = then
            new.write(f"{then.last}\n".encode())
        elif last < step:
            problems = [f"{path} ends with step {last}: the rows up to step {step} are lost"]
        new.flush()
        os.fsync(new.fileno())
    return kept, problems


HEAD = "    step        time [s]    load [Pa] corr.area  friction   iter  residual"
STAMP = re.compile(r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d[.,]\d+ ")
WARNING, MESH = "warning: ", "mesh: "
EVERY_SECONDS = 0.5  # tuning: least time between updates of a progress bar [s]
LEFT_SECONDS = 30.0  # tuning: time between lines with the time left, without a terminal [s]


def step_line(row: StepRow) -> str:
    """Return the line that a run prints for a step, with columns as in the heading `HEAD`."""
    m = row.measures
    return (
        f"{row.step:8d} {row.time:15.8g} {m.pressure:12.5g} {m.contact_area_corrected:9.5f} {m.friction:9.6f} "
        f"{row.iterations:6d} {row.certificate.worst:9.2e}"
    )


def warnings_of(log: Path) -> list[str]:
    """Return all different warnings in a log, in order, or an empty list without a log."""
    return list(dict.fromkeys(line.removeprefix(WARNING) for line in log_lines(log) if line.startswith(WARNING)))


def meshes_of(log: Path) -> list[str]:
    """Return a list with the line in which a log last states the chosen mesh (`march.mesh`). The list is empty if the
    log has no such line."""
    return [line for line in log_lines(log) if line.startswith(MESH)][-1:]


def log_lines(log: Path) -> list[str]:
    """Return the lines of a log without time stamps, or an empty list without a log."""
    return [STAMP.sub("", line) for line in log.read_text(errors="replace").splitlines()] if log.is_file() else []


class Console:
    """Messages of root to the user and to the log; the consoles of other ranks are silent. Raises OSError if the log
    cannot be written."""

    def __init__(self, log: Path | None = None, quiet: bool = True, total: int = 0, speaks: bool = True) -> None:
        self._log = files.open_to_append(log) if log is not None else None
        self._quiet, self._total, self._speaks = quiet, total, speaks
        self._rows, self._first, self._began, self._last_time_left = 0, 0, 0.0, 0.0
        self._bar: tqdm[None] | None = None

    def say(self, text: str) -> None:
        """Show a message to the user, and log it."""
        self.log(text)
        if not self._quiet:
            self._write(text)

    def log(self, text: str) -> None:
        """Write a message with its time to the log only; errors of writing are ignored."""
        if self._log is not None:
            with suppress(OSError):
                self._log.write(f"{datetime.now().isoformat(' ', 'milliseconds')} {printable(text)}\n".encode())

    def warn(self, text: str, shown: bool = True) -> None:
        """Log a warning; if `shown`, print it also in quiet runs."""
        self.log(f"{WARNING}{text}")
        if shown:
            self._write(f"{WARNING}{printable(text)}", sys.stderr)

    def step(self, row: StepRow) -> None:
        """Print the line of a step, and update the progress bar."""
        text = step_line(row)
        self.log(text)
        if self._quiet:
            return
        self._rows += 1
        if self._rows <= 2:  # the first step includes allocations
            self._first, self._began = row.step, time.monotonic()
            self._last_time_left = self._began
        if self._rows == 1:
            print(HEAD)
            if sys.stderr.isatty() and self._total > 1:
                self._bar = tqdm(
                    total=self._total, initial=row.step, unit="step", leave=False, mininterval=EVERY_SECONDS
                )
        self._write(text)
        if self._bar is not None:
            self._bar.update(row.step - self._bar.n)
        else:
            self._say_time_left(row.step)

    def _say_time_left(self, step: int) -> None:
        """Print the time left at intervals, extrapolated from the steps after the first."""
        now = time.monotonic()
        if now - self._last_time_left >= LEFT_SECONDS and self._first < step < self._total:
            self._last_time_left = now
            left = (now - self._began) / (step - self._first) * (self._total - step)
            clock = f"{int(left // 3600)}:{int(left // 60) % 60:02d}:{int(left) % 60:02d}"
            self._write(f"# step {step} of {self._total}, about {clock} left")

    def expect(self, total: int) -> None:
        """Set the expected total number of steps of the progress bar."""
        self._total = total
        if self._bar is not None:
            self._bar.total = total

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
        if self._log is not None:
            with suppress(OSError):
                self._log.close()

    def _write(self, text: str, file: TextIO | None = None) -> None:
        if self._bar is not None:
            self._bar.write(text, file=file)
        elif self._speaks:
            print(text, file=file, flush=True)


@dataclass(frozen=True)
class Recording:
    """Settings of the files that a run writes. The run has `total` steps; this number is an estimate if the run is
    `open_ended`.

    measures.csv has the dissipation of `branches` and the columns `added` by effects. After `every` steps the `maps` of
    a box of this `size` [m] are saved.
    """

    total: int
    branches: int = 0
    added: tuple[str, ...] = ()
    maps: tuple[str, ...] = ()
    size: tuple[float, float] = (0.0, 0.0)
    every: int = 1
    open_ended: bool = False


class Recorder:
    """Writes the outputs of every step; the constructor and all methods but `close` are collective.

    `saved` are the contents of a checkpoint from which the run continues. Raises InputError if files cannot be written.
    `warnings` are messages on lost results of an earlier run. `problem` is a message on results that cannot be written,
    or ''.
    """

    def __init__(
        self, directory: Directory, recording: Recording, provenance: Provenance, saved: Contents | None, quiet: bool
    ) -> None:
        self.slab, self.path, self.problem = directory.slab, directory.path, ""
        self._recording = recording
        self.console = Console(speaks=False)
        self._measures: MeasuresFile | None = None
        table, log = self.path / outputs.RUN.table, self.path / outputs.RUN.log
        columns = recording.branches, recording.added

        def cut_back() -> tuple[TableMark, list[str]]:
            return cut_back_table(table, saved.step, saved.table, *columns) if saved is not None else (TableMark(), [])

        def begin_log() -> None:
            self.console = Console(log, quiet, recording.total)

        def begin_table() -> None:
            self._measures = MeasuresFile(table, kept, *columns)

        kept, self.warnings = hdf5.write_on_root(self.slab, cut_back, f"cannot write {table}", InputError)
        self._fields = self._begin_fields(provenance, saved)
        hdf5.write_on_root(self.slab, begin_log, f"cannot write {log}", InputError)
        hdf5.write_on_root(self.slab, begin_table, f"cannot write {table}", InputError)

    def _begin_fields(self, provenance: Provenance, saved: Contents | None) -> FieldsFile | None:
        path, recording = self.path / outputs.RUN.maps, self._recording
        if not recording.maps or not recording.total:
            if saved is not None:
                self.warnings += filter(None, [fields.cut_back(path, self.slab, saved.step)])
            return None
        last = set[int]() if recording.open_ended else {recording.total}  # steps after which maps are saved, if known
        steps = sorted({*range(recording.every, recording.total + 1, recording.every), *last})
        file = FieldsFile(path, self.slab, recording.size, recording.maps, steps)
        if saved is None:
            file.make(provenance)
        else:
            self.warnings += filter(None, [file.resume(saved.step, provenance)])
        return file

    @property
    def table(self) -> TableMark:
        """Return the number of rows of measures.csv and the last row, for a checkpoint; on root."""
        return self._measures.table if self._measures else TableMark()

    def write(self, row: StepRow, field: Callable[[str], Array], total: int = 0) -> None:
        """Record an instant in all files; `field(name)` returns this rank's rows of a map. `total` is the expected
        number of steps of an open-ended run.

        A failure is stored in `problem`, so that the run saves its state before it ends.
        """
        if total:
            self.console.expect(total)
        self.console.step(row)
        if self._measures:
            with self._noting_problems():
                self._measures.write(row)
        if self._fields and self._recording.open_ended and total:
            with self._noting_problems():
                self._make_place(self._fields, row.step, total)
        self._save_fields(row, field)

    @contextmanager
    def _noting_problems(self) -> Iterator[None]:
        """Store the first failure in `problem`; an OSError, on root only, concerns measures.csv."""
        try:
            yield
        except OSError as error:
            self.problem = self.problem or f"cannot write {self.path / outputs.RUN.table}: {files.reason(error)}"
        except RunError as error:
            self.problem = self.problem or str(error)

    def _make_place(self, file: FieldsFile, step: int, total: int) -> None:
        """Extend the file to the expected number of instants of an open-ended run."""
        every = self._recording.every
        wanted: list[int] = []
        if step >= total:
            wanted = [step]
        elif step and step % every == 0 and step not in file.steps:
            wanted = list(range(step, max(total, 2 * step) + 1, every))
        if wanted and wanted != [last for last in file.steps if last >= step]:
            file.make_place(wanted)

    def catch_up(self, row: StepRow, field: Callable[[str], Array]) -> None:
        """Save the maps of the step from which a run continues, if they are due but not saved."""
        if self._fields and self._fields.is_due(row.step):
            self._save_fields(row, field)

    def _save_fields(self, row: StepRow, field: Callable[[str], Array]) -> None:
        if self._fields and row.step in self._fields.steps:
            with self._noting_problems():
                self._fields.save(row.step, row.time, {name: field(name) for name in self._fields.names})

    def renew(self, provenance: Provenance) -> None:
        """Update the provenance in the files."""
        if self._fields:
            self._fields.renew(provenance)

    def sync(self, provenance: Provenance) -> None:
        """Flush all files, with the new provenance, to disk.

        A failure is stored in `problem` if results are lost, else in `warnings`.
        """
        with self._noting_problems():
            sync = self._measures.sync if self._measures else lambda: None
            hdf5.write_on_root(self.slab, sync, f"cannot write {self.path / outputs.RUN.table}")
            if self._fields:
                self._fields.sync(provenance)
        if self._fields and self._fields.trouble:
            self.console.warn(self._fields.trouble)

    def close(self) -> None:
        """Close the log and the table. This method is not collective, and raises nothing."""
        self.console.close()
        if self._measures:
            self._measures.close()


BATCH_JOBS = ("SLURM_JOB_ID", "PBS_JOBID", "LSB_JOBID", "JOB_ID")
GIGABYTE = 1e9


def machine_lines(comm: MPI.Intracomm) -> Iterator[str]:
    """Yield the lines of a log's header: version, host, command, MPI, ranks, batch job, and numbers of the machine."""
    words = [os.path.basename(sys.argv[0]), *sys.argv[1:]]
    yield f"{PROGRAM} on {socket.gethostname()}, process {os.getpid()}: {shlex.join(words)}"
    yield f"in {os.getcwd()}"
    library = MPI.Get_library_version().splitlines()[0].strip(" \0")
    yield f"{comm.size} rank{'s' if comm.size > 1 else ''}, {library}; Python {platform.python_version()}"
    if found := [f"{name} = {os.environ[name]}" for name in BATCH_JOBS if os.environ.get(name)]:
        yield f"batch job: {', '.join(found)}"
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / GIGABYTE
    load = ", ".join(f"{value:.2f}" for value in os.getloadavg())
    cores = len(os.sched_getaffinity(0))
    yield f"machine: {processor()}, {cores} of {os.cpu_count()} cores, {memory:.3g} GB of memory, load {load}"


def processor() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.partition(":")[2].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()
