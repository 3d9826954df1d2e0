"""The fitted constants of the error budget; the manual's page `coverage` shows how well they hold.

Each constant is judged by the script or test `found_by`, which is kept. `scatter` states the ratio of estimate to true
error: its median and the range of 90 % of the cases, as far as known. Ratios for friction and area belong to the sum of
all sources, ratios for the solver to its own part.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fit:
    """A fitted constant; `order` is the power with which the error falls on refinement."""

    name: str
    value: float
    order: float
    found_by: str
    scatter: str


COVERAGE, MARCHES = "scripts/error_coverage.py", "scripts/march_errors.py"
SOLVES = "scripts/solver_errors.py"
RISES = "tests/scenarios/test_viscoelastic.py"
OF_FRICTION = "3.3, 1 to 45, in 96 % of 956 scenes"
OF_AREA = "3.8, 1.1 to 45, in 96 % of 1284 scenes"

AREA = Fit("area while something slides: times the correction over N^(1/4)", 0.5, 1.0, COVERAGE, OF_AREA)
STILL = Fit("area at rest, and in steady sliding: the same", 0.72, 1.0, COVERAGE, OF_AREA)
IDENTICAL = Fit("errors of the mesh: more where contacts are identical", 4.0, 0.0, COVERAGE, OF_AREA)
VIEWS = Fit("friction of marches: times the difference of its two views", 0.75, 1.5, COVERAGE, OF_FRICTION)
STEADY_AREA = Fit("steady friction: times the correction of the area over N^(1/4)", 0.1, 1.0, COVERAGE, OF_FRICTION)
LOST = Fit("steady friction: what edges lose, times s m", 2.0, 1.0, COVERAGE, OF_FRICTION)
FREE_LOST = Fit("the same in free boxes, with sampled coefficients", 6.0, 1.0, COVERAGE, OF_FRICTION)
ENERGY = Fit("energies: times the error of area", 0.4, 1.0, COVERAGE, "20, in 95 % of 44 scenes with adhesion")
PULL_OFF = Fit(
    "pull-off: times the median error of the area", 0.15, 1.0, COVERAGE, "5.5, 1.1 to 58, in 97 % of 58 scenes"
)
WAVES = Fit(
    "friction: maps with 4 cells per shortest wave, which lack waves",
    0.05,
    2.5,
    "tests/road/test_spectrum.py",
    "1.6 to 2 on 1.75 cells in full contact, more on finer grids",
)
SOLVER = Fit("friction: times the complementarity over N^(1/4)", 1.1, 1.0, SOLVES, "1, 0.12 to 18, of single steps")
SOLVER_AREA = Fit("area: times a power of the complementarity", 0.1, 0.7, SOLVES, "1, 0.14 to 8, of single steps")
PENETRATING = Fit("area: times the points that penetrate without pressure", 0.8, 1.0, SOLVES, "as SOLVER_AREA")
NOISE = Fit("tangential force without friction: times slope and complementarity", 0.8, 1.0, SOLVES, "0.5 to 1.2")
PASSING = Fit(
    "quadratic step: times the cube of the way over the radius of spots",
    0.4,
    3.0,
    MARCHES,
    "2.6 in two cells, 1.5 in one",
)
MANY_WAVES = Fit("steps in full contact: error of many waves over that of one", 1.5, 0.0, MARCHES, "1.2, linear")
PAIR_SHARE = Fit("steps in a slide: of the error that the pair shows, at least", 0.3, 1.0, MARCHES, "as PASSING")
CURVED_RISE = Fit("quadratic step: times <L> of a change of friction", 0.5, 1.0, RISES, "0.7 to 4")
LINEAR_PASSING = Fit("linear step: times the way over the radius of spots, and <L>", 0.66, 1.0, MARCHES, "0.8 to 1")
LINEAR_PAIR = Fit("linear step: times the difference of the pair", 1.7, 1.7, MARCHES, "as LINEAR_PASSING")
EQUAL_DIFFERENCE = Fit(
    "linear pair at which many branches are no worse than one", 0.0072, 0.0, MARCHES, "as LINEAR_PAIR"
)
EULER = Fit("backward Euler: times a power of the difference of the pair", 1.1, 0.5, MARCHES, "0.8 to 1.7")
TIME_AREA = Fit(
    "area: of the error of friction, times a power of what is open",
    0.21,
    1.0 / 3.0,
    MARCHES,
    "2.9 in two cells, 0.4 in one",
)
EULER_AREA = Fit("area: the same of backward Euler", 0.18, 2.0, MARCHES, "1.1")
