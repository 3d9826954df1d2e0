"""The steadily sliding sphere against a moving-frame solver's table.

    .venv/bin/python scripts/steady_table.py [points]

A rigid sphere on an unbounded half space, one relaxation time, G0/G_inf = 10; friction mu R/a* and approach d R/a*^2
over V* = V tau/a*, with a* of Hertz for G0 and tau the creep time. The table was found with an active set and GMRES on
three grids and extrapolated; slower than V* = 0.01 only the limit 0.9 V* is compared with. Exit code 1 if anything is
more than 0.5 % off, or a limit more than 2 %.
"""

import sys
import tempfile
import time
from pathlib import Path

from mpi4py import MPI

from parcontact import job, scene
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding.sliding import Point, SteadySliding

RADIUS, G0, FORCE, CREEP_TIME, BOX = 1.0e-2, 2.75e6, 0.15, 1.0e-2, 4.8
CONTACT = (3 * FORCE * RADIUS / (16 * G0)) ** (1 / 3)
TABLE = {  # V*: mu R/a*, d R/a*^2
    0.01: (0.0089722, 4.6416),
    0.03: (0.026741, 4.6414),
    0.1: (0.087083, 4.6392),
    0.7: (0.49143, 4.541),
    1.0: (0.62549, 4.4527),
    1.4: (0.74768, 4.3107),
    2.0: (0.84099, 4.0728),
    3.2: (0.85262, None),
    10.0: (0.50176, 2.3147),
    100.0: (0.068673, 1.2155),
}
TEXT = """\
grid: {{points: {points}, size: {size!r}, boundary: free}}
surface: {{shape: sphere, radius: 1.0e-2}}
material: {{model: zener, branches: [{{G0: 2.75e6, G1: 305555.5555555556, eta1: 3055.5555555555557}}]}}
history: [{{force: 0.15}}]
numerics: {{tolerance: 1.0e-5}}
"""


def states(points: int, box: float = BOX) -> SteadySliding:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory, "sphere.yaml")
        path.write_text(TEXT.format(points=points, size=box * CONTACT))
        return SteadySliding(scene.set_up(job.load(path), Slab(MPI.COMM_SELF, points, points)))


def solve(sliding: SteadySliding, speed: float, box: float = BOX) -> Point:
    return sliding.solve((speed * CONTACT / CREEP_TIME, 0.0), FORCE / (box * CONTACT) ** 2)


def main(points: int) -> int:
    sliding, wrong = states(points), 0
    print(f"{points} x {points}\n    V*   mu R/a*     table    off   d R/a*^2   table    off   calls  seconds")
    for speed, (friction, approach) in TABLE.items():
        began = time.perf_counter()
        point = solve(sliding, speed)
        found = point.friction * RADIUS / CONTACT, point.measures.approach * RADIUS / CONTACT**2
        off = [value / exact - 1.0 for value, exact in zip(found, (friction, approach), strict=True) if exact]
        wrong += any(abs(value) > 5e-3 for value in off)
        second = f"{approach:8.4f} {off[1]:+7.2%}" if approach else 16 * " "
        print(
            f"{speed:6g} {found[0]:9.6f} {friction:9.6f} {off[0]:+7.2%} {found[1]:8.4f} {second} "
            f"{point.operator_calls:6.0f} {time.perf_counter() - began:7.1f}",
            flush=True,
        )
    for speed, limit, what in ((0.003, 0.9 * 0.003, "0.9 V*"), (1000.0, 7.2 / 1000.0, "7.2/V*")):
        found = solve(sliding, speed).friction * RADIUS / CONTACT
        wrong += abs(found / limit - 1.0) > 2e-2
        print(f"V* = {speed:g}: {found:.7f} over the limit {what}: {found / limit:.4f}", flush=True)
    print("all within 0.5 %, limits within 2 %" if not wrong else f"{wrong} are off")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 512))
