"""A bench that checks in every step what must always hold."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from parcontact.door.doctor import Bench, Watch
from parcontact.files.recorder import StepRow
from parcontact.job.history import Step
from parcontact.march.loop import March

LOAD = 1e-13  # how well the mean pressure is met
BALANCE = {"double": 1e-11, "mixed": 1e-9}  # work = stored + dissipated, over the largest of all times


class StrictBench(Bench):
    """Checks traction, penetration, load, numbers and energies, without the program's own sums."""

    def march(self, data: dict[str, Any], *watches: Watch) -> tuple[March, list[StepRow]]:
        march, rows = super().march(data, self._look, *watches)
        if march.scene.job.output.energy and march.scene.job.numerics.integrator == "exponential":
            self._balance(rows)  # that of the other integrator closes to first order only
        return march, rows

    def _look(self, march: March) -> None:
        self._always(march, march.timeline()[march.row.step])

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

    def _balance(self, rows: Sequence[StepRow]) -> None:
        largest = max(max(abs(row.work), row.stored, row.dissipated) for row in rows)
        for row in rows:
            self.expect("energy", row.stored + row.dissipated, row.work, BALANCE[self.precision], scale=largest)
