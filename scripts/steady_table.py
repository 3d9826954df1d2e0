"""The steadily sliding sphere against a moving-frame solver's table.

    .venv/bin/python scripts/steady_table.py [points]

A rigid sphere on an unbounded half space, one relaxation time, G0/G_inf = 10; friction mu R/a* and approach d R/a*^2
over V* = V tau/a*, with a* of Hertz for G0 and tau the creep time. The table was found with an active set and GMRES on
three grids and extrapolated; slower than V* = 0.01 and faster than 100 only limits are known. Exit code 1 if anything
is more than 0.5 % off, or a limit more than 2 %.
"""

import sys

from mpi4py import MPI

from parcontact import scene
from parcontact.job import load
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding.sliding import SteadySliding

RADIUS, G0, FORCE, CREEP_TIME, BOX = 1.0e-2, 2.75e6, 0.15, 1.0e-2, 4.8
CONTACT = (3 * FORCE * RADIUS / (16 * G0)) ** (1 / 3)
TABLE = {  # V*: mu R/a*, d R/a*^2
    **{0.003: (0.9 * 0.003, None), 0.01: (0.0089722, 4.6416), 0.03: (0.026741, 4.6414), 0.1: (0.087083, 4.6392)},
    **{0.7: (0.49143, 4.541), 1.0: (0.62549, 4.4527), 1.4: (0.74768, 4.3107), 2.0: (0.84099, 4.0728)},
    **{3.2: (0.85262, None), 10.0: (0.50176, 2.3147), 100.0: (0.068673, 1.2155), 1000.0: (7.2 / 1000, None)},
}
LIMITS = (0.003, 1000.0)  # of which only 0.9 V* and 7.2/V* are known
JOB = {
    "grid": {"size": BOX * CONTACT, "boundary": "free"},
    "surface": {"shape": "sphere", "radius": RADIUS},
    "material": {"model": "zener", "branches": [{"G0": G0, "G1": 305555.5555555556, "eta1": 3055.5555555555557}]},
    "history": [{"force": FORCE}],
    "numerics": {"tolerance": 1e-5},
}


def main(points: int) -> int:
    sliding = SteadySliding(scene.set_up(load(JOB, {"grid.points": points}), Slab(MPI.COMM_SELF, points, points)))
    wrong = 0
    print(f"{points} x {points}\n    V*   mu R/a*     table    off   d R/a*^2   table    off   calls")
    for speed, (friction, approach) in TABLE.items():
        point = sliding.solve((speed * CONTACT / CREEP_TIME, 0.0), FORCE / (BOX * CONTACT) ** 2)
        found = point.friction * RADIUS / CONTACT, point.measures.approach * RADIUS / CONTACT**2
        off = [value / exact - 1.0 for value, exact in zip(found, (friction, approach), strict=True) if exact]
        wrong += any(abs(value) > (2e-2 if speed in LIMITS else 5e-3) for value in off)
        second = f"{approach:8.4f} {off[1]:+7.2%}" if approach else 16 * " "
        print(f"{speed:6g} {found[0]:9.6f} {friction:9.6f} {off[0]:+7.2%} {found[1]:8.4f} {second}", end="")
        print(f" {point.operator_calls:6.0f}", flush=True)
    print("all within 0.5 %, limits within 2 %" if not wrong else f"{wrong} are off")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 512))
