"""The files that grow with a run: run.log, measures.csv and fields.h5, begun or continued after a step."""

from collections.abc import Callable, Sequence

from ..effects import decisions
from ..errors import InputError, RunError
from ..job import Job
from ..parallel.slab import Array, Slab
from . import fields, hdf5, measures
from .checkpoint import Table
from .console import Console, Silence
from .directory import Directory
from .fields import FieldsFile
from .measures import MeasuresFile
from .provenance import Provenance
from .row import Row


class Recorder:
    """Writes what a job asks for after every step; making one, and its methods, are collective.

    Parameters: the `directory`; the `provenance` of its files; `total` steps of the run, about so many if it is
    `open_ended`; `after`, the step after which it goes on, or None to begin, and what the `table` of measures held;
    `dissipated`, the number of branches whose dissipation has a column; `added`, the columns of effects. Raises
    InputError where the files cannot be written. `warnings` says what was lost of an earlier run, `problem` what of the
    results cannot be written.
    """

    def __init__(
        self,
        job: Job,
        slab: Slab,
        directory: Directory,
        provenance: Provenance,
        total: int,
        after: int | None,
        then: Table,
        dissipated: int,
        quiet: bool,
        added: Sequence[str] = (),
        open_ended: bool = False,
    ) -> None:
        self._every = job.output.every if open_ended else 0
        self.slab, self.path, self.problem = slab, directory.path, ""
        self.console: Console | Silence = Silence()
        self._measures: MeasuresFile | None = None
        self.warnings: list[str] = []

        table, log = self.path / "measures.csv", self.path / "run.log"

        def begin_table() -> None:
            kept = Table()
            if after is not None:
                kept, lost = measures.cut_back(table, after, dissipated, then, added)
                self.warnings += lost
            self._measures = MeasuresFile(table, dissipated, kept, added)

        def begin_log() -> None:
            self.console = Console(log, quiet, total)

        hdf5.on_root(slab, begin_table, f"cannot write {table}", InputError)
        hdf5.on_root(slab, begin_log, f"cannot write {log}", InputError)
        self._fields = self._begin_fields(job, provenance, total, after)

    def _begin_fields(self, job: Job, provenance: Provenance, total: int, after: int | None) -> FieldsFile | None:
        path, output = self.path / "fields.h5", job.output
        if not decisions.fields(job).on or not total:
            if after is not None:
                self.warnings += filter(None, [fields.cut_back(path, self.slab, after)])
            return None
        ends = set[int]() if self._every else {total}
        steps: Sequence[int] = sorted({*range(output.every, total + 1, output.every), *ends})
        file = FieldsFile(path, self.slab, job.grid.size, output.fields, steps)
        if after is None:
            file.make(provenance)
        else:
            self.warnings += filter(None, [file.resume(after, provenance)])
        return file

    @property
    def table(self) -> Table:
        """What measures.csv holds; on root."""
        return self._measures.table if self._measures else Table()

    def write(self, row: Row, field: Callable[[str], Array], total: int = 0) -> None:
        """Record an instant; `field(name)` gives this rank's rows of a map. `total` is how many steps an open-ended run
        will have, as far as is known by now; when the row's step is the last one, its number.

        What goes wrong is left in `problem`, for the next decision, which saves the state first.
        """
        if total:
            self.console.expect(total)
        self.console.step(row)
        if self._measures:
            try:
                self._measures.write(row)
            except OSError as error:
                self.problem = f"cannot write {self._measures.path}: {hdf5.reason(error)}"
        if self._fields and self._every and total:
            self._make_place(self._fields, row.step, total)
        self._save_fields(row, field)

    def _make_place(self, file: FieldsFile, step: int, total: int) -> None:
        """In an open-ended run there may be more instants than were foreseen, and in the end there are as many as there
        are."""
        wanted: list[int] = []
        if step >= total:
            wanted = [step]
        elif step % self._every == 0 and step not in file.steps:
            wanted = list(range(step, max(total, 2 * step) + 1, self._every))
        if wanted and wanted != [last for last in file.steps if last >= step]:
            try:
                file.make_place(wanted)
            except RunError as error:
                self.problem = self.problem or str(error)

    def catch_up(self, row: Row, field: Callable[[str], Array]) -> None:
        """Save the maps of the step after which a run goes on, if they are due and could not be saved then."""
        if self._fields and self._fields.lacks(row.step):
            self._save_fields(row, field)

    def _save_fields(self, row: Row, field: Callable[[str], Array]) -> None:
        if self._fields and row.step in self._fields.steps:
            try:
                self._fields.save(row.step, row.time, {name: field(name) for name in self._fields.names})
            except RunError as error:
                self.problem = self.problem or str(error)

    def renew(self, provenance: Provenance) -> None:
        """Put what has changed of where they come from into the files."""
        if self._fields:
            self._fields.renew(provenance)

    def sync(self, provenance: Provenance) -> None:
        """Wait until all that was recorded is on the disk, with where it comes from.

        What is wrong with it is left in `problem`, if results are lost by it, or warned of.
        """
        try:
            sync = self._measures.sync if self._measures else lambda: None
            hdf5.on_root(self.slab, sync, f"cannot write {self.path / 'measures.csv'}")
            if self._fields:
                self._fields.sync(provenance)
        except RunError as error:
            self.problem = self.problem or str(error)
        if self._fields and self._fields.trouble:
            self.console.warn(self._fields.trouble)

    def close(self) -> None:
        """Not collective; raises nothing."""
        self.console.close()
        if self._measures:
            self._measures.close()
