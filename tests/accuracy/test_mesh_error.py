"""Errors by the mesh, along the sliding and across it, and what is said of them."""

import math
from dataclasses import replace

import pytest

from parcontact.accuracy.budget import ErrorSums, estimate
from parcontact.accuracy.mesh_error import friction_by_mesh
from parcontact.accuracy.time_error import RunProperties, StepObservation, count_spots, spot_radius

KNOWN = RunProperties(8.0, False, 1e-4, True)
SEEN = StepObservation(1e-3, 4e-4, 2.0, 0.02, 0.02, 0.1, 0.095)
EDGES = 0.25 / 19 + 0.6 / 19**2  # of the area of SEEN, corrected by a 19th
LONG = replace(KNOWN, cell=(1.0, 4.0))  # 8 cells per wave along y, 32 along x


@pytest.mark.parametrize(("way", "along", "across"), [((2.0, 0.0), 32.0, 8.0), ((0.0, -1.0), 8.0, 32.0)])
def test_the_mesh_along_the_sliding_and_across_it(way: tuple[float, float], along: float, across: float) -> None:
    """Of the module of `mesh_error`: 94 % and 6 % of what squares with the cells of each direction make; of the area by
    the length of the cells. A mean side is 2.5 of the shorter ones."""
    seen = replace(SEEN, way=way)
    found = estimate(LONG, seen, 10_000)
    assert found.friction is not None
    radius, spots = spot_radius(LONG, seen, 10_000), count_spots(LONG, seen, 10_000)
    assert spots == pytest.approx(0.1 * 10_000 * 4.0 / (math.pi * (2.5 * radius) ** 2))

    def squares(cells: float) -> float:
        cell = 32.0 / cells
        return 0.05 * (4.0 / cells) ** 2.5 + 0.9 * 0.13 / (2.5 * radius / cell) ** 2.3 / spots**0.25

    assert found.friction.along == pytest.approx(0.94 * squares(along))
    assert found.friction.across == pytest.approx(0.06 * squares(across))
    mesh = EDGES + 0.25 / radius**1.6 / spots**0.5
    assert found.area.mesh == pytest.approx(mesh)
    assert found.area.across == pytest.approx(mesh * (0.8 if along > across else 0.2))


@pytest.mark.parametrize(("cells", "counts"), [(8.0, 0.2), (3.5, 0.2 * (4.0 / 3.5) ** 6), (2.5, 1.0)])
def test_waves_of_steady_sliding(cells: float, counts: float) -> None:
    """A steady state has a fifth of what waves make in a march, by the root of what is open, a point of 10 000 at
    least. A map may lack waves, so that its share counts in full contact, too, and rises below 4 cells."""
    for area in (0.1, 0.9999, 1.0):
        seen, known = replace(SEEN, area=area, corrected=area, way=(1.0, 0.0)), replace(KNOWN, cells_per_wave=cells)
        bare = sum(friction_by_mesh(replace(known, cells_per_wave=None), seen, 10_000, steady=True))
        march = sum(friction_by_mesh(known, seen, 10_000, steady=False)) - bare
        rough, measured = (
            sum(friction_by_mesh(replace(known, measured=map_), seen, 10_000, steady=True)) - bare
            for map_ in (False, True)
        )
        assert measured == pytest.approx(counts * march)
        assert rough == pytest.approx(0.2 * march * math.sqrt(max(1.0 - area, 1e-4)))


def test_squares_are_as_at_rest() -> None:
    """The parts along and across add up to what the mesh makes of squares."""
    still, slides = (estimate(KNOWN, replace(SEEN, way=way), 10_000) for way in ((0.0, 0.0), (0.3, 0.4)))
    assert still.friction is not None
    assert slides.friction is not None
    assert still.friction.across == 0.0
    assert slides.friction.across == pytest.approx(0.06 * slides.friction.mesh)
    assert slides.friction.total == pytest.approx(still.friction.total, rel=1e-14)
    assert slides.area.total == pytest.approx(still.area.total, rel=1e-14)


def test_advice_names_the_direction_that_pays() -> None:
    """Cells four times as long across the sliding, and along it."""
    told = []
    for way in ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0)):
        budget = estimate(replace(LONG, cells_per_wave=3.0), replace(SEEN, complementarity=1e-9, way=way), 10_000)
        friction, area = ErrorSums().plus(budget, 0.02, 1.0, 1e-3).lines((1e-6, 1e-6))
        told.append((friction.partition("try ")[2], area.partition("try ")[2]))
    more = "more grid.points {} the sliding".format
    assert told[0] == (more("across"), more("across"))
    assert told[1] == (more("along"), more("along"))
    assert told[2] == ("a finer grid", "a finer grid")


def test_a_checkpoint_without_directions_goes_on() -> None:
    """Sums of an earlier version: solver, time, folded branches, mesh."""
    old = ErrorSums().plus(estimate(KNOWN, SEEN, 10_000), 0.02, 3.0, 3e-4)
    found = ErrorSums.restored({"sums": old.sums[:, :5].ravel()})
    assert found.friction == old.friction
    assert found.plus(estimate(KNOWN, SEEN, 10_000), 0.02, 3.0, 3e-4).area == old.area
