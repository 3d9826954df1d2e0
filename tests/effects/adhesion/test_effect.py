"""The section `adhesion`: what goes with it, what it warns of, what `check` tells."""

import math
from contextlib import nullcontext as does_not_raise
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from parcontact.effects.adhesion.effect import FORCE_DOUBT, AdhesiveEnergies, advance_energies, law_of
from parcontact.effects.effect import Sheared, SolvedContact
from parcontact.errors import InputError
from parcontact.job import Job
from parcontact.job.reading import sentences_of
from parcontact.march import sanity
from parcontact.march.budget import ENERGY
from parcontact.march.mesh import load, load_cases
from parcontact.march.scene import set_up
from parcontact.parallel.slab import Slab
from parcontact.physics.records import Measures

E = 4e6  # E* of an incompressible body of 1 MPa [Pa]
RUBBER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 9e6, "relaxation_time": 1.0}]}


def job(**changes: Any) -> Job:
    return load(
        {
            "grid": {"points": 64, "size": 4e-4},
            "surface": {"shape": "sphere", "radius": 1e-3},
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "adhesion": {"work": 0.05, "range": 4e-7},
            "history": [{"approach": 0.0}],
            **changes,
        }
    )


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"adhesion": {"work": 0.0}}, "adhesion.work must be a positive work of adhesion"),
        ({"adhesion": {"work": 0.05, "range": "short"}}, "adhesion.range must be a positive range"),
        ({"adhesion": {"work": 0.05, "range": 1e-7}, "material": RUBBER}, "adhesion.range must be at least 1.98e-07 m"),
        ({"adhesion": {"work": 0.05}, "material": {**RUBBER, "modulus_inf": 0.0}}, "without long-term modulus"),
        ({"material": {"model": "elastic", "shear_modulus": 1e6, "hardness": 1e9}}, "cannot be used with adhesion"),
        ({"steady": {"velocities": [1.0], "pressures": [1e3]}}, "steady cannot be used with adhesion"),
        ({"adhesion": None, "history": [{"pressure": -1e3}]}, "must be a pressure [Pa] of zero or more"),
    ],
)
def test_mistakes(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as failure:
        job(**changes)
    assert sentence in str(failure.value)


def test_a_liquid_has_no_process_zone() -> None:
    """Without long-term modulus no cell is too long for it; the work over a range is a strength all the same."""
    liquid = job(material={**RUBBER, "modulus_inf": 0.0}, adhesion={"work": 0.05, "range": 4e-7})
    assert liquid.facts == ("adhesion: a body without long-term modulus has no process zone of its own",)
    assert not any("process zone" in doubt for doubt in liquid.warnings)


def test_loads_may_pull() -> None:
    assert job(history=[{"pressure": {"from": 0.0, "to": -1e3}, "duration": 1.0}]).history[0].load.end == -1e3


def test_the_range_that_the_mesh_resolves() -> None:
    """Two cells are one process zone, `l = E* rho^2/w`."""
    auto = job(adhesion={"work": 0.05})
    law = law_of(auto)
    assert law.zone == pytest.approx(2 * 4e-4 / 64, rel=1e-12)


@pytest.mark.parametrize(
    ("reach", "key", "values", "stated"),
    [
        ("auto", "grid.points", [32, 64], "gives 3.953e-07 to 5.59e-07 m"),
        ("auto", "adhesion.work", [0.05, 0.0125], "gives 1.976e-07 to 3.953e-07 m"),
        ("auto", "surface.radius", [1e-3, 2e-3], ""),
        (4e-7, "adhesion.work", [0.05, 0.0125], ""),
    ],
)
def test_ranges_that_differ_in_a_sweep_are_stated(
    reach: float | str, key: str, values: list[float], stated: str
) -> None:
    """Two cells are a process zone: `rho = sqrt(2 h w/E*)`, with the longer one resolved by all cases."""
    data = {
        "grid": {"points": 64, "size": 4e-4, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": 1e-3},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "adhesion": {"work": 0.05, "range": reach},
        "history": [{"approach": 0.0}],
        "sweep": [{key: values}],
    }
    found = [text for text in sentences_of(load_cases(data), lambda job: ()) if "different physics" in text]
    assert [stated in text for text in found] == [True] * bool(stated)


@pytest.mark.parametrize(("reach", "warned"), [(4e-7, False), (2.7e-7, True)])
def test_a_mesh_that_is_too_coarse(reach: float, warned: bool) -> None:
    """A cell is 6.25e-6 m, the process zone 12.8e-6 and 5.8e-6 m."""
    texts = [text for text in job(adhesion={"work": 0.05, "range": reach}).warnings if text.startswith("adhesion")]
    assert bool(texts) == warned
    assert all("a range of 2.8e-07 m" in text for text in texts)


@pytest.mark.parametrize(
    ("work", "reach", "size", "sentence"),
    [
        (1.0, 4e-6, 4e-3, ""),
        (1.01, 4e-6, 4e-3, "at most 1 J/m^2"),
        (0.79, 4e-7, 1e-3, ""),
        (0.81, 4e-7, 1e-3, "about work/(E* range) = 0.51"),
        (0.05, 7.9e-5, 4e-4, ""),
        (0.05, 8.1e-5, 4e-4, "more than 0.2 of the box"),
    ],
)
def test_magnitudes_that_cannot_be_meant(work: float, reach: float, size: float, sentence: str) -> None:
    """On both sides of each limit."""
    scene = job(adhesion={"work": work, "range": reach}, grid={"points": 2048, "size": size})
    texts = [text for text in scene.warnings if text.startswith("adhesion")]
    assert [sentence in text for text in texts] == [True] * bool(sentence)


@pytest.mark.parametrize(("cell", "wrong"), [(2.0, 0.03), (2.5, 0.17)])
def test_cells_that_do_not_see_a_sphere(cell: float, wrong: float) -> None:
    """The attraction of an undeformed sphere, `exp(-r^2/2 R rho)`, summed over cells of a given number of sqrt(R rho):
    by Poisson's sum it is wrong by `4 exp(-2 pi^2/cell^2)`, to the next terms."""
    x = cell * np.arange(-20, 21)
    total = (np.exp(-(x**2) / 2) * np.exp(-(x[:, None] ** 2) / 2)).sum() * cell**2
    assert total / (2 * math.pi) - 1 == pytest.approx(wrong, abs=0.01)
    size, points, radius = 4e-4, 64, 1e-3
    reach = (size / points / (1.001 * cell)) ** 2 / radius
    warned = job(material={"model": "elastic", "shear_modulus": 1e11}, adhesion={"work": 0.05, "range": reach}).warnings
    assert any("times sqrt(radius range)" in text for text in warned) == (1.001 * cell > 2.0)


def test_what_check_tells() -> None:
    """Process zone, Tabor's parameter of a sphere and Johnson's of a wave, from their definitions."""
    zone, sphere = job().facts
    assert "process zone l = 1.28e-05 m, cell h = 0.488 l" in zone
    assert f"Tabor's parameter {(1e-3 * 0.05**2 / (E**2 * 4e-7**3)) ** (1 / 3):.3g}: between" in sphere
    _, wave = job(surface={"shape": "wave", "amplitude": 1e-6, "waves": [2, 0]}).facts
    alpha = math.sqrt(2 * 0.05 * 2e-4 / (math.pi**2 * E)) / 1e-6
    assert f"Johnson's parameter {alpha:.3g}: full contact without load" in wave


# -- adhesion next to a sphere, heights and neighbours: each limit from both sides; approaches beyond full -------------

R = 1e-3  # radius of the sphere [m]


def ball(**changes: Any) -> Job:
    """A sphere of radius R in a free box, with a range of 0.5 um."""
    grid, sphere = {"points": 64, "size": 4e-4, "boundary": "free"}, {"shape": "sphere", "radius": R}
    return job(**{"grid": grid, "surface": sphere, "adhesion": {"work": 0.05, "range": 5e-7}, **changes})


def adhesive(work: float, reach: float, law: str = "exponential") -> dict[str, Any]:
    return {"adhesion": {"work": work, "range": reach, "law": law}}


TOUCHING = (2e-4) ** 2 / (2 * R)  # gap at the edge of the box [m]


@pytest.mark.parametrize(
    ("changes", "without", "sentence"),
    [
        (adhesive(0.05, 0.505 * R), adhesive(0.05, 0.495 * R), "more than its radius, 0.001 m"),
        (adhesive(0.05, TOUCHING / 4.59), adhesive(0.05, TOUCHING / 4.62), "1 % of its attraction"),
        (adhesive(0.05, TOUCHING / 0.98, "dugdale"), adhesive(0.05, TOUCHING / 0.995, "dugdale"), "of its attraction"),
    ],
)
def test_limits(changes: dict[str, Any], without: dict[str, Any], sentence: str) -> None:
    """Half the radius; 1 % of the attraction beyond the gap 4.605 rho, or 0.99 rho of Dugdale's law."""
    assert sentence in "\n".join(ball(**changes).warnings)
    assert sentence not in "\n".join(ball(**without).warnings)


def test_no_range_is_short_enough_for_a_sphere_at_the_edge_of_its_box() -> None:
    sphere = {"shape": "sphere", "radius": R, "center": [0.0, 2e-4]}
    (text,) = (text for text in ball(surface=sphere).warnings if "of its attraction" in text)
    assert text.endswith("use 6.79e-05 m of room around the sphere")  # sqrt(2 ln(100) R 5e-7)


def test_a_range_above_the_roughness() -> None:
    """From the lowest to the highest point of a wave is twice its amplitude."""
    for share, stated in ((0.99, False), (1.01, True)):
        wave = {"shape": "wave", "amplitude": 1e-6, "waves": [4, 0]}
        one = ball(surface=wave, grid={"points": 64, "size": 4e-4}, **adhesive(0.05, 2e-6 * share))
        found = map(str, sanity.find_doubts(set_up(one, Slab.alone(64, 64))))
        assert any("more than the 2e-06 m from the lowest to the highest" in text for text in found) == stated


def test_a_range_that_follows_the_cells_is_not_asked_to() -> None:
    """With `auto`, cells of 6.25e-6 m make a range of 0.5 um or so, which is far above a wave of 10 nm."""
    wave, stated = {"shape": "wave", "amplitude": 1e-8, "waves": [4, 0]}, []
    for reach in ("auto", 1e-6):
        one = ball(surface=wave, grid={"points": 64, "size": 4e-4}, adhesion={"work": 0.05, "range": reach})
        stated += [str(one) for one in sanity.find_doubts(set_up(one, Slab.alone(64, 64))) if "beyond" in one.kind]
    assert [text.split("use ")[-1] for text in stated] == [
        "more grid.points, which range: auto follows",
        "a shorter range (range: auto follows the cells)",
    ]


@pytest.mark.parametrize("work", [None, 0.05])
def test_neighbours_of_a_sphere_are_stated_from_a_per_cent_on(work: float | None) -> None:
    """By Hertz with `1.917 (a/L)^3`, 1.917 from Epstein's sum 4 zeta(3/2) beta(3/2) less what is far; with adhesion by
    the pull-off 1.5 pi w R as well, where a relaxed body is as soft as it gets."""
    for share, stated in ((0.17, False), (0.18, True)):
        length = 4e-4
        changes: dict[str, Any] = {"history": [{"force": 4 * E * (share * length) ** 3 / (3 * R)}], "adhesion": None}
        if work:
            length = (1.125 * math.pi * work * R**2 / E) ** (1 / 3) / share
            changes = {"history": [{"force": 0.0}], "adhesion": {"work": work, "range": 1e-7}}
        found = "\n".join(ball(grid={"points": 64, "size": length}, **changes).warnings)
        assert ("its images in the periodic box" in found) == stated
        found = "\n".join(ball(grid={"points": 64, "size": length, "boundary": "free"}, **changes).warnings)
        assert "images" not in found


# -- full contact -----------------------------------------------------------------------------------------------------


def test_approaches_beyond_full_contact_are_refused_before_the_first_step() -> None:
    """A sphere in a periodic box closes when its mean is at the level of the body: at `L^2 (1 + 2/n^2)/(12 R)` for the
    mean of r^2/(2 R) over n points a side of a box L."""
    n, length = 16, 4e-4
    closed = length**2 * (1 + 2 / n**2) / (12 * R)
    grid = {"points": n, "size": length}
    for boundary, share, refused in (("periodic", 0.999, False), ("periodic", 1.001, True), ("free", 1.001, False)):
        history = [{"approach": 0.0}, {"approach": {"from": 0.0, "to": share * closed}, "duration": 1.0}]
        setup = set_up(ball(grid={**grid, "boundary": boundary}, history=history), Slab.alone(n, n))
        with (
            pytest.raises(InputError, match=rf"history\.1: an approach of .* at {closed:.6g} m; approach no further")
            if refused
            else does_not_raise()
        ):
            sanity.refuse_approaches(setup)


# -- energies of a step, of given works -------------------------------------------------------------------------------

AREA = 2.0  # of the box [m^2]
STEP = 0.25 * ENERGY.value * 4.0  # error of the dissipation, 4 J
SHEARED = Sheared(Measures(), (0.0, 0.0), 10.0, np.zeros(0), 0.125, 0.5, 0.0625, 0.0625)  # 10 J lost, to 37.5 %


@pytest.mark.parametrize(
    ("pushed", "jumps", "force", "approach", "expected"),
    [
        (2.0, False, (0.0, 0.0), 0.0, (3.0, 1.0, 0.5, 0.1 + STEP)),  # the work is what is gained, 2 J
        (4.0, False, (0.0, 0.0), 0.0, (5.0, 1.0, 2.5, 0.1 + STEP)),  # more than any path needs: a snap
        (4.0, False, (0.0, 0.0), 0.4, (3.0, 1.0, 0.5, 2.1 + STEP)),  # a doubt of 2.4 J, of the path
        (0.0, False, (0.0, 0.0), 0.0, (3.0, 1.0, 0.5, 2.1 + STEP)),  # less: an error of the rule
        (1.0, True, (0.0, 0.0), 0.0, (3.0, 1.0, 0.5, 0.1 + STEP)),  # between states without equilibrium
        (
            0.0,
            False,
            (-1.0, -3.0),
            0.0,
            (3.0, 1.0, 0.5, 0.1 + 2.0 + STEP),
        ),  # drag of 4 J, in doubt by 2 + 6 FORCE_DOUBT
        (
            2.0 * FORCE_DOUBT * 3.0 + 0.1,
            False,
            (-1.0, -3.0),
            0.0,
            (3.1 + 2.0 + 6.0 * FORCE_DOUBT, 1.0, 2.6 + 6.0 * FORCE_DOUBT, 0.1 + STEP),
        ),
    ],
)
def test_energies_of_a_step(
    pushed: float, jumps: bool, force: tuple[float, float], approach: float, expected: tuple[float, ...]
) -> None:
    """Work, energy of surfaces, loss in snaps and error after a step of known works, to rounding. Surfaces take 1 J
    from 2 J, and the body 3 J. The trapezoidal rule for the path and for the drag has an error of half the change."""
    numbers = {"surface_energy": 1.0, "work_of_load": pushed, "leaves_equilibrium": float(jumps)}
    instant: Any = SimpleNamespace(
        solved=SimpleNamespace(numbers=numbers),
        before=Measures(pressure=1.0),
        measures=Measures(pressure=7.0, approach=approach),
        sheared=None,
        gained=3.0,
        error_area=0.25,
        dissipated=-4.0,
        moved=(2.0, 0.0),
    )
    forces = (force[0], 5.0), (force[1], 5.0)  # those along y do no work
    found = advance_energies(AdhesiveEnergies(1.0, 2.0, 0.5, 0.1), instant, AREA, forces)
    assert found == pytest.approx(expected, rel=1e-12)
    instant.sheared = SHEARED
    found = advance_energies(AdhesiveEnergies(1.0, 2.0, 0.5, 0.1), instant, AREA, forces)
    assert found.error == pytest.approx(expected[3] + 10.0 * 0.375, rel=1e-12)


def test_a_contact_of_which_all_may_be_an_error_is_not_loaded() -> None:
    contact: Any = None
    solved = SolvedContact(contact, None, np.zeros(1), least_load=1.0)
    assert solved.loaded
    assert not replace(solved, least_load=math.inf).loaded
