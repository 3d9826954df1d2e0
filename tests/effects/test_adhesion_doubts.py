"""Adhesion beside a sphere, heights and neighbours: each limit from both sides; approaches beyond full contact."""

import math
from contextlib import nullcontext as does_not_raise
from typing import Any

import numpy as np
import pytest

import parcontact as pc
from parcontact.errors import InputError
from parcontact.job import Job, load
from parcontact.parallel.slab import Slab
from parcontact.scene import sanity, set_up

E, R = 4e6, 1e-3  # E* of an incompressible body of 1 MPa [Pa], radius of the sphere [m]


def job(**changes: Any) -> Job:
    return load(
        {
            "grid": {"points": 64, "size": 4e-4, "boundary": "free"},
            "surface": {"shape": "sphere", "radius": R},
            "material": {"model": "elastic", "shear_modulus": E / 4},
            "adhesion": {"work": 0.05, "range": 5e-7},
            "history": [{"approach": 0.0}],
            **changes,
        }
    )


def sticking(work: float, reach: float, law: str = "exponential") -> dict[str, Any]:
    return {"adhesion": {"work": work, "range": reach, "law": law}}


TOUCHING = (2e-4) ** 2 / (2 * R)  # gap at the edge of the box [m]


@pytest.mark.parametrize(
    ("changes", "without", "sentence"),
    [
        (sticking(0.05, 0.505 * R), sticking(0.05, 0.495 * R), "more than its radius, 0.001 m"),
        (sticking(0.05, TOUCHING / 4.59), sticking(0.05, TOUCHING / 4.62), "1 % of its attraction"),
        (sticking(0.05, TOUCHING / 0.98, "dugdale"), sticking(0.05, TOUCHING / 0.995, "dugdale"), "of its attraction"),
    ],
)
def test_limits(changes: dict[str, Any], without: dict[str, Any], sentence: str) -> None:
    """Half the radius; 1 % of the attraction beyond the gap 4.605 rho, or 0.99 rho of Dugdale's law."""
    assert sentence in "\n".join(job(**changes).warnings)
    assert sentence not in "\n".join(job(**without).warnings)


def test_no_range_is_short_enough_for_a_sphere_at_the_edge_of_its_box() -> None:
    sphere = {"shape": "sphere", "radius": R, "center": [0.0, 2e-4]}
    (text,) = (text for text in job(surface=sphere).warnings if "of its attraction" in text)
    assert text.endswith("passes: use 6.79e-05 m of room around the sphere")  # sqrt(2 ln(100) R 5e-7)


def test_a_range_above_the_roughness() -> None:
    """From the lowest to the highest point of a wave is twice its amplitude."""
    for share, told in ((0.99, False), (1.01, True)):
        wave = {"shape": "wave", "amplitude": 1e-6, "waves": [4, 0]}
        one = job(surface=wave, grid={"points": 64, "size": 4e-4}, **sticking(0.05, 2e-6 * share))
        found = map(str, sanity.find_doubts(set_up(one, Slab.alone(64, 64))))
        assert any("more than the 2e-06 m from the lowest to the highest" in text for text in found) == told


@pytest.mark.parametrize("work", [None, 0.05])
def test_neighbours_of_a_sphere_are_told_from_a_per_cent_on(work: float | None) -> None:
    """By Hertz with `1.917 (a/L)^3`, 1.917 from Epstein's sum 4 zeta(3/2) beta(3/2) less what is far; with adhesion by
    the pull-off 1.5 pi w R as well, where a relaxed body is as soft as it gets."""
    for share, told in ((0.17, False), (0.18, True)):
        length = 4e-4
        changes: dict[str, Any] = {"history": [{"force": 4 * E * (share * length) ** 3 / (3 * R)}], "adhesion": None}
        if work:
            length = (1.125 * math.pi * work * R**2 / E) ** (1 / 3) / share
            changes = {"history": [{"force": 0.0}], "adhesion": {"work": work, "range": 1e-7}}
        found = "\n".join(job(grid={"points": 64, "size": length}, **changes).warnings)
        assert ("its images in the periodic box" in found) == told
        found = "\n".join(job(grid={"points": 64, "size": length, "boundary": "free"}, **changes).warnings)
        assert "images" not in found


def test_neighbours_make_a_sphere_blunter_or_sharper_as_told() -> None:
    """The peak of a Hertz pressure goes with R^(-2/3): in a box of four radii of the contact it rises by 2/3 of
    1.917/64, within 0.2 % of the mesh and of higher orders of a/L."""
    a, length = 1e-4, 4e-4
    force = 4 * E * a**3 / (3 * R)
    peaks = []
    for boundary in ("periodic", "free"):
        changes = {"grid": {"points": 64, "size": length, "boundary": boundary}, "adhesion": None}
        simulation = pc.Simulation(job(**changes, history=[{"force": force}], numerics={"tolerance": 1e-5}))
        with pytest.warns(UserWarning, match="by 2.9 %") if boundary == "periodic" else does_not_raise():
            list(simulation.steps())
        peaks.append(np.max(simulation.field("pressure")))
    assert peaks[0] / peaks[1] - 1.0 == pytest.approx(2 / 3 * 1.917 / 64, abs=2e-3)


# -- full contact -----------------------------------------------------------------------------------------------------


def test_approaches_beyond_full_contact_are_refused_before_the_first_step() -> None:
    """A sphere in a periodic box closes when its mean is at the level of the body: at `L^2 (1 + 2/n^2)/(12 R)` for the
    mean of r^2/(2 R) over n points a side of a box L."""
    n, length = 16, 4e-4
    closed = length**2 * (1 + 2 / n**2) / (12 * R)
    grid = {"points": n, "size": length}
    for boundary, share, refused in (("periodic", 0.999, False), ("periodic", 1.001, True), ("free", 1.001, False)):
        history = [{"approach": 0.0}, {"approach": {"from": 0.0, "to": share * closed}, "duration": 1.0}]
        setup = set_up(job(grid={**grid, "boundary": boundary}, history=history), Slab.alone(n, n))
        with (
            pytest.raises(InputError, match=rf"history\.1: an approach of .* at {closed:.6g} m; approach no further")
            if refused
            else does_not_raise()
        ):
            sanity.refuse_beyond_full_contact(setup)
