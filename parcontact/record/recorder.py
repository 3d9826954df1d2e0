"""The files that grow with a run: run.log, measures.csv and fields.h5, begun or continued after a step."""

from collections.abc import Callable, Sequence

from ..effects import decisions as calls_for
from ..errors import InputError
from ..job import Job
from ..parallel.slab import Array, Slab
from . import fields, hdf5, measures
from .console import Console, Silence
from .directory import Directory
from .fields import FieldsFile
from .measures import MeasuresFile
from .provenance import Provenance
from .row import Row


class Recorder:
    """Writes what a job asks for after every step; making one, and its methods, are collective.

    Parameters: the `directory`; the `provenance` of its files; `total` steps of the run; `after`, the step after which
    it goes on, or None to begin; `dissipated`, the number of branches whose dissipation has a column. Raises InputError
    where the files cannot be written. `warnings` says what was lost of an earlier run.
    """

    def __init__(
        self,
        job: Job,
        slab: Slab,
        directory: Directory,
        provenance: Provenance,
        total: int,
        after: int | None,
        dissipated: int,
        quiet: bool,
    ) -> None:
        self.slab, self.path, self.problem = slab, directory.path, ""
        self.console: Console | Silence = Silence()
        self._measures: MeasuresFile | None = None
        self.warnings: list[str] = []

        table, log = self.path / "measures.csv", self.path / "run.log"

        def begin_table() -> None:
            if after is not None:
                self.warnings += filter(None, [measures.cut_back(table, after, dissipated)])
            self._measures = MeasuresFile(table, dissipated)

        def begin_log() -> None:
            self.console = Console(log, quiet, total)

        hdf5.on_root(slab, begin_table, f"cannot write {table}", InputError)
        hdf5.on_root(slab, begin_log, f"cannot write {log}", InputError)
        self._fields = self._begin_fields(job, provenance, total, after)

    def _begin_fields(self, job: Job, provenance: Provenance, total: int, after: int | None) -> FieldsFile | None:
        path, output = self.path / "fields.h5", job.output
        if not calls_for.fields(job).on or not total:
            if after is not None:
                fields.cut_back(path, self.slab, after)
            return None
        steps: Sequence[int] = sorted({*range(output.every, total + 1, output.every), total})
        file = FieldsFile(path, self.slab, job.grid.size, output.fields, steps)
        if after is None:
            file.make(provenance)
        else:
            self.warnings += filter(None, [file.resume(after, provenance)])
        return file

    def write(self, row: Row, field: Callable[[str], Array]) -> None:
        """Record an instant; `field(name)` gives this rank's rows of a map.

        What goes wrong with root's lines is left in `problem`, for the next decision to tell the other ranks.
        """
        if self.slab.root and self._measures:
            try:
                self.console.step(row)
                self._measures.write(row)
            except OSError as error:
                self.problem = f"cannot write {self.path / 'measures.csv'}: {hdf5.reason(error)}"
        if self._fields and row.step in self._fields.steps:
            self._fields.save(row.step, row.time, {name: field(name) for name in self._fields.names})

    def sync(self) -> None:
        """Wait until all that was recorded is on the disk, so that no checkpoint is ahead of it; raises RunError."""

        def sync() -> None:
            if self._measures:
                self._measures.sync()

        hdf5.on_root(self.slab, sync, f"cannot write {self.path / 'measures.csv'}")
        if self._fields:
            self._fields.sync()

    def close(self) -> None:
        """Not collective."""
        self.console.close()
        if self._measures:
            self._measures.close()
