"""Cones, pyramids and punches against closed forms. With the profile f(r) and

    g(x) = x int_0^x f'(r)/sqrt(x^2 - r^2) dr,     d = g(a),     F = 2 E* int_0^a (d - g(x)) dx

for the contact radius a (L. A. Galin 1953, I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47). A cone of slope m has g = pi
m x/2; a punch with a face of radius b and an edge of radius R has g = x/R (sqrt(x^2 - b^2) - b arccos(b/x)) beyond b
(G. Schubert, Ing.-Arch. 13 (1942) 132), and without the edge F = 2 E* b d.
"""

import math
from typing import Any

import numpy as np
import pytest
from marched_jobs import marched
from numpy.testing import assert_allclose
from physics.maps import coordinates

from parcontact.files.recorder import StepRow
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.physics.surface import Conical, FlatEnded, Pyramidal, Shape

SIZE, G = 1e-3, 1e6
STIFFNESS = 4.0 * G  # E* of an incompressible body [Pa]


def data_of(surface: dict[str, Any], **load: float) -> dict[str, Any]:
    data = {"grid": {"points": 48, "size": SIZE, "boundary": "free"}, "surface": surface, "history": [load]}
    material = {"model": "elastic", "shear_modulus": G, "poisson": 0.5}
    return {**data, "material": material, "numerics": {"tolerance": 1e-4}}


def pressed(surface: dict[str, Any], **load: float) -> StepRow:
    return marched(data_of(surface, **load))[1][-1]


def force(row: StepRow) -> float:
    return row.measures.pressure * SIZE**2


def test_cone() -> None:
    """Twelve cells in the radius of contact: the force to 1 %, the radius to 2 %."""
    slope, radius = 0.1, 0.25 * SIZE
    row = pressed({"shape": "cone", "slope": slope}, approach=math.pi / 2.0 * slope * radius)
    assert force(row) == pytest.approx(math.pi / 2.0 * STIFFNESS * slope * radius**2, rel=1e-2)
    assert math.sqrt(row.measures.contact_area_corrected * SIZE**2 / math.pi) == pytest.approx(radius, rel=2e-2)


def test_pyramid() -> None:
    """The load varies as the square of the depth, and is between those of the inscribed and the circumscribed cone."""
    slope, depths = 0.1, (1.5e-5, 3e-5)
    loads = [force(pressed({"shape": "pyramid", "slope": slope}, approach=depth)) for depth in depths]
    assert loads[1] / loads[0] == pytest.approx(4.0, rel=2e-2)
    cone = 2.0 / math.pi * STIFFNESS * depths[1] ** 2 / slope
    assert cone < loads[1] < math.sqrt(2.0) * cone


@pytest.mark.parametrize("share", [0.0, 0.5, 0.8])
def test_punch_with_a_round_edge(share: float) -> None:
    """Faces of some shares of the radius of contact; without a face it is Hertz's sphere. Forces to 1 %."""
    radius, edge = 0.3 * SIZE, 5e-3
    face = share * radius

    def depth(x: Any) -> Any:
        far = np.maximum(x, face)
        return far / edge * (np.sqrt(far**2 - face**2) - face * np.arccos(face / far))

    x = np.linspace(1e-3 * radius, radius, 2000)
    exact = 2.0 * STIFFNESS * np.trapezoid(depth(radius) - depth(x), x)
    surface = {"shape": "punch", "radius": max(face, 1e-9), "edge": edge}
    row = pressed(surface, approach=float(depth(radius)))
    assert force(row) == pytest.approx(exact, rel=1e-2)


def test_sharp_punch() -> None:
    """An edge far below a cell is that of a sharp punch, whose radius the mesh has to half a cell of 19."""
    radius, depth = 0.4 * SIZE, 1e-6
    row = pressed({"shape": "punch", "radius": radius, "edge": 1e-9}, approach=depth)
    assert force(row) == pytest.approx(2.0 * STIFFNESS * radius * depth, rel=0.5 / 19)
    assert row.measures.contact_area == pytest.approx(math.pi * radius**2 / SIZE**2, rel=2e-2)


@pytest.mark.parametrize("shape", [Conical(0.2, (0, 0)), Pyramidal(0.2, (0, 0)), FlatEnded(0.3, 0.5, (0, 0))])
def test_slopes_are_those_of_the_heights(shape: Shape) -> None:
    """Central differences of the heights, away from creases; a shape is level at its centre."""
    x, y = (each - 0.513 for each in coordinates(Slab.alone(16, 16), (1.0, 1.0)))
    x, y = x + 0.0 * y, 1.01 * y + 0.0 * x
    step = 1e-6
    along_x = (shape.height(x + step, y) - shape.height(x - step, y)) / (2.0 * step)
    along_y = (shape.height(x, y + step) - shape.height(x, y - step)) / (2.0 * step)
    assert_allclose(shape.slope(x, y), [along_x, along_y], atol=2e-6)
    centre = np.zeros(1)
    assert_allclose([shape.height(centre, centre), *shape.slope(centre, centre)], 0.0, atol=0.0)


def test_a_steep_cone_is_doubted() -> None:
    """Slopes count in the small-slope theory; a warning names the slope."""
    steep, small = (Job.model_validate(data_of({"shape": "cone", "slope": m}, force=1e-3)).doubts for m in (1.0, 0.1))
    assert any("slope" in str(doubt) for doubt in steep)
    assert not any("slope" in str(doubt) for doubt in small)
