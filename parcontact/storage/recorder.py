"""The growing files of a run: run.log, measures.csv and fields.h5, begun or continued."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ..errors import InputError, RunError
from ..parallel.slab import Array
from . import fields, hdf5
from .checkpoint import Contents, TableMark
from .console import Console
from .directory import Directory
from .fields import FieldsFile
from .provenance import Provenance
from .step_row import MeasuresFile, StepRow, cut_back_table


@dataclass(frozen=True)
class Recording:
    """Outputs of a run of `total` steps (an estimate if `open_ended`). The table has the dissipation of `branches` and
    the columns `added` by effects; `maps` of a box of this `size` [m] are saved after `every` steps."""

    total: int
    branches: int = 0
    added: tuple[str, ...] = ()
    maps: tuple[str, ...] = ()
    size: tuple[float, float] = (0.0, 0.0)
    every: int = 1
    open_ended: bool = False

    @property
    def map_steps(self) -> list[int]:
        """Return the steps after which maps are saved, as far as known."""
        last = set[int]() if self.open_ended else {self.total}
        return sorted({*range(self.every, self.total + 1, self.every), *last})


class Recorder:
    """Writes the outputs of every step; the constructor and all methods but `close` are collective.

    `saved` is the state in a checkpoint from which the run continues. Raises InputError if files cannot be written.
    `warnings` are messages on lost results of an earlier run, `problem` is a message on results that cannot be written.
    """

    def __init__(
        self, directory: Directory, recording: Recording, provenance: Provenance, saved: Contents | None, quiet: bool
    ) -> None:
        self.slab, self.path, self.problem = directory.slab, directory.path, ""
        self._recording = recording
        self.console = Console(speaks=False)
        self._measures: MeasuresFile | None = None
        table, log = self.path / "measures.csv", self.path / "run.log"
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
        path, recording = self.path / "fields.h5", self._recording
        if not recording.maps or not recording.total:
            if saved is not None:
                self.warnings += filter(None, [fields.cut_back(path, self.slab, saved.step)])
            return None
        file = FieldsFile(path, self.slab, recording.size, recording.maps, recording.map_steps)
        if saved is None:
            file.make(provenance)
        else:
            self.warnings += filter(None, [file.resume(saved.step, provenance)])
        return file

    @property
    def table(self) -> TableMark:
        """Return the state of measures.csv, on root."""
        return self._measures.table if self._measures else TableMark()

    def write(self, row: StepRow, field: Callable[[str], Array], total: int = 0) -> None:
        """Record an instant; `field(name)` returns this rank's rows of a map. `total` is the expected number of steps
        of an open-ended run.

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
            self.problem = self.problem or f"cannot write {self.path / 'measures.csv'}: {hdf5.reason(error)}"
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
        """Flush all records and the provenance to disk.

        A failure is stored in `problem` if results are lost, else in `warnings`.
        """
        with self._noting_problems():
            sync = self._measures.sync if self._measures else lambda: None
            hdf5.write_on_root(self.slab, sync, f"cannot write {self.path / 'measures.csv'}")
            if self._fields:
                self._fields.sync(provenance)
        if self._fields and self._fields.trouble:
            self.console.warn(self._fields.trouble)

    def close(self) -> None:
        """Close the log and the table; not collective; raises nothing."""
        self.console.close()
        if self._measures:
            self._measures.close()
