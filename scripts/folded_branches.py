"""What numerics.branch_error saves and costs: the surface of jobs/velocity_step.yaml slides at 3 m/s over 0.5 mm.

    .venv/bin/python scripts/folded_branches.py [points]

A virgin body of the twelve-branch compound, one cell per step. Columns:

    maps     branches that have a map
    bound    what friction may be wrong by, as the run says
    error    what it is wrong by: the largest difference from friction with all branches, over its last value; solved to
             a tolerance of 1e-8, so that the solver's own error is less
    memory   time of a pass through the body's memory, over that with all branches; the shortest of some
    time     time of a step, and `calls` operator calls, over those with all branches, at the default tolerance

The runs take their steps in turn, so that what else the machine does befalls all alike.
"""

import sys
import time
from pathlib import Path

from mpi4py import MPI

from parcontact import job, scene
from parcontact.history.timeline import Timeline
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab
from parcontact.physics.body import Heights, ZenerBody
from parcontact.storage.row import Row

JOB = Path(__file__).parents[1] / "jobs" / "velocity_step.yaml"
SLIDE = "history=[{pressure: 1.0e5, velocity: 3.0, distance: 5.0e-4, cells_per_step: 1}]"
ERRORS = (0.0, 1e-5, 1e-4, 1e-3, 1e-2)
PASSES = 20


def sliding(points: int, allowed: float, tolerance: float) -> March:
    """The run before its first step."""
    numerics = [f"numerics.branch_error={allowed!r}", f"numerics.tolerance={tolerance!r}"]
    slide = job.load(JOB, [f"grid.points={points}", "initial={state: virgin}", "output={}", SLIDE, *numerics])
    return March(scene.build(slide, Slab(MPI.COMM_SELF, points, points)))


def together(runs: list[March]) -> list[list[Row]]:
    """The rows of runs that take their steps in turn."""
    timeline = Timeline.of(runs[0].scene.job)
    return [list(rows) for rows in zip(*([run.advance(step) for run in runs] for step in timeline), strict=True)]


def memory_pass(run: March) -> float:
    """The shortest time [s] of a pass through the memory of a run that is over."""
    body = run.scene.material
    assert isinstance(body, ZenerBody)
    u = body.u.copy()
    spent = []
    for _ in range(PASSES):
        began = time.perf_counter()
        body.commit(body.begin(1e-6, Heights(u)), u)
        spent.append(time.perf_counter() - began)
    return min(spent)


def main(points: int) -> None:
    exact = together([sliding(points, allowed, 1e-8) for allowed in ERRORS])
    runs = [sliding(points, allowed, 1e-4) for allowed in ERRORS]
    usual = together(runs)
    whole = [row.measures.friction for row in exact[0]]
    passes = [memory_pass(run) for run in runs]
    spent = [sum(row.seconds for row in rows[1:]) for rows in usual]
    calls = [sum(row.operator_calls for row in rows) for rows in usual]
    print(
        f"{'allowed':>9}{'maps':>6}" + "".join(f"{name:>9}" for name in ("bound", "error", "memory", "time", "calls"))
    )
    for n, allowed in enumerate(ERRORS):
        found = runs[n].scene.folded
        error = max(abs(row.measures.friction - mu) for row, mu in zip(exact[n], whole, strict=True)) / whole[-1]
        ratios = passes[n] / passes[0], spent[n] / spent[0], calls[n] / calls[0]
        print(f"{allowed:9g}{len(found.kept):6}{found.bound:9.1e}{error:9.1e}" + "".join(f"{r:9.3f}" for r in ratios))


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 256)
