"""Edges of contact that open and close steadily on a relaxing body, against the theory of the steady crack.

A layer on a smooth base sticks to a flat punch that lifts it by d. Wherever the edge of the contact is, it sets free
`G = E* d^2/(2 T)` per area, with the thickness T and without Poisson's ratio. So a lift is held, and the velocity is
measured that belongs to its G. Before that the layer is lifted so slowly that it is relaxed where it sticks; and before
the edge turns back, the layer is open for so long that it is relaxed there, too.
"""

import numpy as np
import pytest
from closed_forms import viscoelastic_adhesion
from numpy.testing import assert_allclose
from sticking import MODULUS, WORK, Job, Map, ramp, steps

from parcontact.python.row import Row

RATIO, TIME = 10.0, 1e-2  # k = E_inf/E_0, relaxation time [s]
CREEP = RATIO * TIME  # [s]
SHEAR = MODULUS / 2  # of the relaxed layer [Pa]
BRANCH = SHEAR * (RATIO - 1)
CELL, BOX, DEPTH = 1e-6, 9, 10.0  # [m]; length of the box, half of which is the punch, in T; depth beside it, in ranges
THEORIES = viscoelastic_adhesion.opening_crack, viscoelastic_adhesion.closing_crack


def strengths(velocity: float) -> Map:
    """G/w by theory of an edge that opens and of one that closes, at V over (c0/CREEP)."""
    return np.array([theory(velocity / CREEP, SHEAR, [BRANCH], [TIME]) for theory in THEORIES])


def layer(cells: int, thickness: int, *history: Job) -> Job:
    """A layer of so many process zones, each of which has so many cells."""
    zone, points = cells * CELL, BOX * thickness * cells
    reach = float(np.sqrt(zone * WORK / MODULUS))
    branch = {"modulus": BRANCH, "relaxation_time": TIME}
    return {
        "grid": {"points": [points, 1], "size": [points * CELL, CELL]},
        "surface": {"shape": "array", "heights": np.where(np.arange(points) < points // 2, 0.0, -DEPTH * reach)[None]},
        "body": {"thickness": thickness * zone, "base": "smooth"},
        "material": {"model": "zener", "modulus_inf": SHEAR, "branches": [branch], "poisson": 0.0},
        "adhesion": {"work": WORK, "range": reach, "law": "dugdale"},
        "history": list(history),
        "numerics": {"tolerance": 1e-4},
    }


def speed(rows: list[Row], points: int) -> float:
    """Cells per CREEP by which each of two edges moves, from the instants at which points change sides."""
    areas, instants = np.unique([row.contact_area for row in rows], return_index=True)
    assert len(areas) > 5
    return abs(float(np.polyfit([rows[instant].time / CREEP for instant in instants], areas * points / 2, 1)[0]))


def excess(velocity: float, way: float, count: int, cells: int, thickness: int) -> Map:
    """G over that of theory at the velocity which is seen, opening and closing, less 1. The lifts that are held, each
    for a `way` in c0 and so many steps, are those of theory at `velocity`."""
    given, held = strengths(velocity), way / velocity * CREEP
    opening, closing = (-np.sqrt(2 * thickness * cells * CELL * given * WORK / MODULUS)).tolist()
    history = (
        ramp(0.0, opening, 100, 3 * CREEP * (1 + 1 / velocity)),
        ramp(opening, opening, count, held),
        ramp(opening, closing, 100, 10 * CREEP),
        ramp(closing, closing, count, held),
    )
    job = layer(cells, thickness, {"approach": 0.0}, *history)
    *_, last = rows = list(steps(job))
    assert 0 < last.contact_area < 0.5
    steady = rows[-100 - 3 * count // 2 : -100 - count], rows[-count // 2 :]
    seen = (speed(part, job["grid"]["points"][0]) / (np.pi / 4 * cells) for part in steady)
    return given / [strengths(each)[side] for side, each in enumerate(seen)] - 1


@pytest.mark.filterwarnings("ignore:surface")  # of cells per wave: it is a step
@pytest.mark.parametrize(("velocity", "way", "count"), [(0.1, 6, 600), (10, 20, 400)])
def test_steady_crack(velocity: float, way: float, count: int) -> None:
    """G/w is 1.1981 and 4.5272 for edges that open with `velocity`, 0.8175 and 0.2001 for those that close. The error
    is of second order in the cells, here a quarter and an eighth of l, and of first order in l/T: both extrapolated,
    0.2 % are left, to which the instants add some 0.2 %. Alone, the meshes are up to 3 % and 1.3 % off."""
    coarse, fine, thick = (excess(velocity, way, count, *each) for each in ((4, 80), (8, 80), (4, 160)))
    print(coarse, fine, thick)
    assert np.all(np.abs(fine) < np.abs(coarse))
    assert_allclose(coarse + (fine - coarse) * 4 / 3 + (thick - coarse) * 2, 0, atol=5e-3)
