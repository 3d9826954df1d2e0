"""The calibrated constants of the error budget, in one table; the manual's page `coverage` shows how well they do.

Each was fitted to true errors by the script that it names. `scatter` says how far the errors lie from the law: the
estimate over the true error, its median and the range of nine tenths, over unseen scenes where there are any.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fit:
    """A calibrated constant: its `order` is the power with which the error falls with what is refined."""

    name: str
    value: float
    order: float
    found_by: str
    scatter: str


COVERAGE, MARCHES, RISES = (
    "scripts/error_coverage.py",
    "scripts/march_errors.py",
    "tests/scenarios/test_slide_from_rest.py",
)

AREA = Fit("area: times the correction over N^(1/4)", 0.6, 1.0, COVERAGE, "")
STEADY = Fit("area in steady sliding: the same", 0.8, 1.0, COVERAGE, "")
ALIKE = Fit("area: more where contacts are all alike", 2.0, 0.0, COVERAGE, "")
STEADY_ALIKE = Fit("steady friction: more where contacts are all alike", 6.0, 0.0, COVERAGE, "")
STRAIGHT = Fit("area: more along edges that follow the grid", 4.0, 0.0, COVERAGE, "")
VIEWS = Fit("friction of marches: times the difference of its two views", 1.1, 1.5, COVERAGE, "")
STEADY_LOST = Fit("steady friction: times what edges lose", 0.8, 1.0, COVERAGE, "")
STEADY_AREA = Fit("steady friction: times the correction of the area over N^(1/4)", 0.24, 1.0, COVERAGE, "")
LOST = Fit("what edges lose: times s m", 2.0, 1.0, COVERAGE, "")
FREE_LOST = Fit("the same in free boxes, with sampled coefficients", 6.0, 1.0, COVERAGE, "")
WAVES = Fit("friction: maps with 4 cells per shortest wave, which lack waves", 0.05, 2.5, "tests/road", "")
SOLVER = Fit("friction: times the complementarity over N^(1/4)", 1.1, 1.0, COVERAGE, "")
SOLVER_AREA = Fit("area: times a power of the complementarity", 0.1, 0.7, COVERAGE, "")
PENETRATING = Fit("area: times the points that penetrate without pressure", 0.8, 1.0, COVERAGE, "")
NOISE = Fit("tangential force without friction: times slope and complementarity", 0.4, 1.0, COVERAGE, "")
PASSING = Fit("quadratic step: times the cube of the way over the radius of spots", 0.4, 3.0, MARCHES, "")
TURNING = Fit("quadratic step in full contact: times <L> and the angle squared", 0.45, 2.0, MARCHES, "")
TURNING_4 = Fit("quadratic step in full contact: times the angle^4", 0.02, 4.0, MARCHES, "")
PAIR = Fit("quadratic step: times the difference of the pair", 1.0, 3.0, MARCHES, "")
PAIR_SHARE = Fit("steps in a slide: of the error that the pair shows, at least", 0.3, 1.0, MARCHES, "")
CURVED_RISE = Fit("quadratic step: times <L> of a change of friction", 0.5, 1.0, RISES, "")
LINEAR_PASSING = Fit("linear step: times the way over the radius of spots, and <L>", 0.66, 1.0, MARCHES, "")
LINEAR_TURNING = Fit("linear step in full contact: times the angle squared", 0.125, 2.0, MARCHES, "")
LINEAR_PAIR = Fit("linear step: times the difference of the pair", 1.7, 1.7, MARCHES, "")
EQUAL_DIFFERENCE = Fit("linear pair at which many branches are no worse than one", 0.0072, 0.0, MARCHES, "")
EULER = Fit("backward Euler: times a power of the difference of the pair", 1.1, 0.5, MARCHES, "")
TIME_AREA = Fit("area: of the error of friction, times a power of what is open", 0.21, 1.0 / 3.0, COVERAGE, "")
EULER_AREA = Fit("area: the same of backward Euler", 0.18, 2.0, COVERAGE, "")
