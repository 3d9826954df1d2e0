"""A bench for checks: it runs small jobs and compares results with exact values."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..history.timeline import Timeline
from ..job import Job
from ..march.loop import March
from ..parallel.slab import Array, Slab
from ..steady_sliding import start
from ..storage.step_row import StepRow

if TYPE_CHECKING:
    from mpi4py import MPI

Json = dict[str, Any]
Watch = Callable[[March], None]


@dataclass(frozen=True)
class Finding:
    """A result, its exact value, and the allowed absolute error."""

    what: str
    found: float
    expected: float
    allowed: float

    @property
    def share(self) -> float:
        """Return the error over the allowed error; infinite for NaN."""
        error = abs(self.found - self.expected)
        if math.isnan(error):
            return math.inf
        return error / self.allowed if self.allowed > 0.0 else (math.inf if error else 0.0)

    @property
    def ok(self) -> bool:
        return self.share <= 1.0

    def __str__(self) -> str:
        if self.expected == 0.0:
            return f"{self.what} = {self.found:.2g} (0 ± {self.allowed:.1g})"
        return f"{self.what} = {self.found:.6g} ({self.expected:.6g} ± {self.allowed:.1g})"


class Bench:
    """Runs jobs on the ranks of `comm` in one precision, and keeps the worst finding of each name."""

    def __init__(self, comm: "MPI.Intracomm", precision: str = "double") -> None:
        self.comm, self.precision = comm, precision
        self.findings: dict[str, Finding] = {}
        self.residual, self.iterations, self.failure = 0.0, 0, ""

    @property
    def wrong(self) -> list[str]:
        """Return the findings beyond their limits as texts."""
        return [*filter(None, [self.failure]), *(str(found) for found in self.findings.values() if not found.ok)]

    @property
    def nearest(self) -> str:
        """Return the finding with the largest `share`."""
        return self.failure or str(max(self.findings.values(), key=lambda found: found.share))

    # -- running -------------------------------------------------------------------------------------------------------

    def begin(self, data: Json) -> March:
        """Return a march at the start of a job, by default with a tolerance of 1e-10 and all branches; collective."""
        numerics = {"tolerance": 1e-10, "branch_error": 0.0, **data.get("numerics", {}), "precision": self.precision}
        job = Job.model_validate({**data, "numerics": numerics})
        march = start.first(job, Slab(self.comm, *job.grid.points))
        self._note(march.row)
        return march

    def march(self, data: Json, *watches: Watch) -> tuple[March, list[StepRow]]:
        """Return a march at the end of a job, and the rows of all instants including the initial one; collective."""
        march = self.begin(data)
        job, rows = march.scene.job, [march.row]
        for step in Timeline.from_job(job):
            rows.append(march.advance(step))
            self._note(march.row)
            for watch in watches:
                watch(march)
        return march, rows

    def whole(self, march: March, name: str) -> Array:
        """Return a field of all ranks, shape (ny, nx), on every rank; collective."""
        return np.concatenate(march.scene.slab.from_all(march.field(name)))

    def amplitude(self, march: March) -> float:
        """Return the amplitude of the pressure of a wave that is longer than two cells [Pa]; collective."""
        return float(np.sqrt(2.0) * np.std(self.whole(march, "pressure")))

    def _note(self, row: StepRow) -> None:
        self.residual = float(np.max((self.residual, row.certificate.worst)))  # NaN if one of them is NaN
        self.iterations = max(self.iterations, row.iterations)

    # -- expected values -----------------------------------------------------------------------------------------------

    def expect(self, what: str, found: float, expected: float, within: float, scale: float | None = None) -> None:
        """Record a result with an allowed error of `within` times `scale` (default: the exact value)."""
        allowed = within * (abs(float(expected)) if scale is None else scale)
        finding = Finding(what, float(found), float(expected), allowed)
        known = self.findings.get(what)
        if known is None or finding.share >= known.share:
            self.findings[what] = finding

    def expect_all(self, what: str, found: ArrayLike, expected: ArrayLike, within: float) -> None:
        """Record many results with an allowed error of `within` times the largest exact value."""
        found, expected = np.broadcast_arrays(np.asarray(found, float), np.asarray(expected, float))
        largest = float(np.abs(expected).max())
        for one, other in zip(found.ravel(), expected.ravel(), strict=True):
            self.expect(what, one, other, within, scale=largest)
