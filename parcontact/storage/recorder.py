"""The files that grow with a run: run.log, measures.csv and fields.h5, begun or continued after a step."""

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
    """The outputs of a run of `total` steps, or about so many if `open_ended`: the dissipation of so many `branches`,
    the columns `added` by effects, and the `maps` of a box of this `size` [m] after `every` so many steps."""

    total: int
    branches: int = 0
    added: tuple[str, ...] = ()
    maps: tuple[str, ...] = ()
    size: tuple[float, float] = (0.0, 0.0)
    every: int = 1
    open_ended: bool = False

    @property
    def map_steps(self) -> list[int]:
        """The steps after which maps are saved, as far as they are known."""
        last = set[int]() if self.open_ended else {self.total}
        return sorted({*range(self.every, self.total + 1, self.every), *last})


class Recorder:
    """Writes what is asked for after every step; making one, and its methods, are collective.

    A run that goes on from a checkpoint gives what that has, as `saved`. Raises InputError where the files cannot be
    written. `warnings` says what was lost of an earlier run, `problem` what of the results cannot be written.
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
        """The state of measures.csv, on root."""
        return self._measures.table if self._measures else TableMark()

    def write(self, row: StepRow, field: Callable[[str], Array], total: int = 0) -> None:
        """Record an instant; `field(name)` gives this rank's rows of a map. `total` is how many steps an open-ended run
        will have, as far as is known by now; when the row's step is the last one, its number.

        What goes wrong is left in `problem`, for the next decision, which saves the state first.
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
        """Leave the first failure in `problem`; of an OSError, which root alone has, it is of measures.csv."""
        try:
            yield
        except OSError as error:
            self.problem = self.problem or f"cannot write {self.path / 'measures.csv'}: {hdf5.reason(error)}"
        except RunError as error:
            self.problem = self.problem or str(error)

    def _make_place(self, file: FieldsFile, step: int, total: int) -> None:
        """Make place for as many instants as an open-ended run has, in the end or when there are more than foreseen."""
        every = self._recording.every
        wanted: list[int] = []
        if step >= total:
            wanted = [step]
        elif step and step % every == 0 and step not in file.steps:
            wanted = list(range(step, max(total, 2 * step) + 1, every))
        if wanted and wanted != [last for last in file.steps if last >= step]:
            file.make_place(wanted)

    def catch_up(self, row: StepRow, field: Callable[[str], Array]) -> None:
        """Save the maps of the step after which a run goes on, if they are due and could not be saved then."""
        if self._fields and self._fields.is_due(row.step):
            self._save_fields(row, field)

    def _save_fields(self, row: StepRow, field: Callable[[str], Array]) -> None:
        if self._fields and row.step in self._fields.steps:
            with self._noting_problems():
                self._fields.save(row.step, row.time, {name: field(name) for name in self._fields.names})

    def renew(self, provenance: Provenance) -> None:
        """Put what has changed of where they come from into the files."""
        if self._fields:
            self._fields.renew(provenance)

    def sync(self, provenance: Provenance) -> None:
        """Wait until all that was recorded is on the disk, with where it comes from.

        What cannot be written is left in `problem`, if results are lost by it, or warned of.
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
