"""A bench for checks: it marches small jobs, looks in every step at what must always hold, and notes what came out."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..history.timeline import Step, Timeline
from ..job import Job
from ..march.loop import March
from ..parallel.slab import Array, Slab
from ..steady_sliding import start
from ..storage.row import Row

if TYPE_CHECKING:
    from mpi4py import MPI

Json = dict[str, Any]
Watch = Callable[[March], None]
LOAD = 1e-13  # how well the mean pressure is met
BALANCE = {"double": 1e-11, "mixed": 1e-9}  # work = stored + dissipated, over the largest of all times


@dataclass(frozen=True)
class Finding:
    """One number that came out, what it should be, and how far off it may be (absolute)."""

    what: str
    found: float
    expected: float
    allowed: float

    @property
    def share(self) -> float:
        """The error over what is allowed: at most 1 if all is well; infinite for what is not a number."""
        error = abs(self.found - self.expected)
        if math.isnan(error):
            return math.inf
        return error / self.allowed if self.allowed > 0.0 else (math.inf if error else 0.0)

    @property
    def ok(self) -> bool:
        return self.share <= 1.0

    def __str__(self) -> str:
        if self.expected == 0.0:
            return f"{self.what} = {self.found:.2g} (0 +- {self.allowed:.1g})"
        return f"{self.what} = {self.found:.6g} ({self.expected:.6g} +- {self.allowed:.1g})"


class Bench:
    """Marches jobs on the ranks of `comm` in one precision. Of each thing found it keeps the worst."""

    def __init__(self, comm: "MPI.Intracomm", precision: str = "double") -> None:
        self.comm, self.precision = comm, precision
        self.findings: dict[str, Finding] = {}
        self.residual, self.iterations = 0.0, 0

    # -- running ------------------------------------------------------------------------------------------------------

    def begin(self, data: Json) -> March:
        """A march at the start of a job, which is solved to 1e-10 and with all branches unless it says otherwise;
        collective."""
        numerics = {"tolerance": 1e-10, "branch_error": 0.0, **data.get("numerics", {}), "precision": self.precision}
        job = Job.model_validate({**data, "numerics": numerics})
        march = start.first(job, Slab(self.comm, *job.grid.points))
        self._note(march.row)
        return march

    def march(self, data: Json, *watches: Watch) -> tuple[March, list[Row]]:
        """A march at the end of a job, and the row of every instant, the initial one first; collective."""
        march = self.begin(data)
        job, rows = march.scene.job, [march.row]
        for step in Timeline.of(job):
            rows.append(march.advance(step))
            self._note(march.row)
            self._always(march, step)
            for watch in watches:
                watch(march)
        if job.output.energy and job.numerics.integrator == "exponential":  # the other closes to first order only
            self._balance(rows)
        return march, rows

    def whole(self, march: March, name: str) -> Array:
        """A field of all ranks, on every rank; collective."""
        return np.concatenate(march.scene.slab.from_all(march.field(name)))

    def amplitude(self, march: March) -> float:
        """Return the amplitude of the pressure of a wave that is longer than two cells [Pa]; collective."""
        return float(np.sqrt(2.0) * np.std(self.whole(march, "pressure")))

    def _note(self, row: Row) -> None:
        self.residual = float(np.max((self.residual, row.certificate.worst)))  # NaN if one is
        self.iterations = max(self.iterations, row.iterations)

    # -- what must always hold ----------------------------------------------------------------------------------------

    def _always(self, march: March, step: Step) -> None:
        """No traction, no penetration, the load met, nothing that is not a number; collective.

        Without the program's own sums, which may be what is wrong.
        """
        built, measures = march.scene, march.row.measures
        tolerance = built.job.numerics.tolerance
        pressure, gap = march.field("pressure"), march.field("gap")
        own = pressure.sum(dtype=np.float64), (-pressure).max(initial=-np.inf), (-gap).max(initial=-np.inf)
        loads, tractions, penetrations = zip(*built.slab.from_all(own), strict=True)
        load, traction, penetration = math.fsum(loads), float(max(tractions)), float(max(penetrations))
        self.expect("traction", max(traction, 0.0), 0.0, 0.0)
        self.expect("penetration", max(penetration / built.setup.height, 0.0), 0.0, 1.1 * tolerance, scale=1.0)
        self.expect("residual", march.row.certificate.worst, 0.0, tolerance, scale=1.0)
        numbers = dataclasses.astuple(measures)
        self.expect("numbers", math.fsum(abs(x) < math.inf for x in numbers), float(len(numbers)), 0.0)
        if step.control != "approach":
            area = built.job.grid.lx * built.job.grid.ly if step.control == "force" else 1.0
            scale = step.load + 1e-30 * built.units.pressure * area  # less is none
            self.expect("load", load / built.slab.points * area, step.load, LOAD, scale)
            self.expect("measured load", measures.pressure * area, step.load, LOAD, scale)

    def _balance(self, rows: Sequence[Row]) -> None:
        largest = max(max(abs(row.work), row.stored, row.dissipated) for row in rows)
        for row in rows:
            self.expect("energy", row.stored + row.dissipated, row.work, BALANCE[self.precision], scale=largest)

    # -- what is expected ---------------------------------------------------------------------------------------------

    def expect(self, what: str, found: float, expected: float, within: float, scale: float | None = None) -> None:
        """Note a number that may be off by `within` times `scale`, which is its expected size unless given."""
        allowed = within * (abs(float(expected)) if scale is None else scale)
        finding = Finding(what, float(found), float(expected), allowed)
        known = self.findings.get(what)
        if known is None or finding.share >= known.share:
            self.findings[what] = finding

    def expect_all(self, what: str, found: ArrayLike, expected: ArrayLike, within: float) -> None:
        """Note many numbers, each of which may be off by `within` times the largest expected one."""
        found, expected = np.broadcast_arrays(np.asarray(found, float), np.asarray(expected, float))
        largest = float(np.abs(expected).max())
        for one, other in zip(found.ravel(), expected.ravel(), strict=True):
            self.expect(what, one, other, within, scale=largest)


ALWAYS = ("traction", "penetration", "residual", "numbers", "load", "measured load", "energy")
