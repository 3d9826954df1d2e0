"""The way out for solves that crawl: against the projected method, and where that fails."""

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.contact import Contact, ContactSolver
from parcontact.solve.fallback import active_set
from parcontact.solve.problem import Approach, MeanPressure
from parcontact.solve.workspace import Workspace

from ..bodies import TIGHT, Bench, keep, rough, solver, white


def found_by_sets(body: Bench, h: Any, control: MeanPressure | Approach, start: float = 0.0) -> Contact:
    return active_set.solve(body.solver, body.problem(h, control), np.full_like(h, start))


@pytest.mark.parametrize(("boundary", "kernel"), [("periodic", "spectral"), ("periodic", "love"), ("free", "love")])
@pytest.mark.parametrize("mean", [0.1, 0.5, 20.0])
def test_agrees_with_the_projected_method(boundary: str, kernel: str, mean: float) -> None:
    """Under a load, and at the approach that comes with it."""
    h = rough(64)
    options: Any = {"boundary": boundary, "kernel": kernel, "tolerance": TIGHT}
    expected = keep(solver(h, **options).solve(h, MeanPressure(mean), np.zeros_like(h)))
    controls: list[MeanPressure | Approach] = [MeanPressure(mean)]
    if np.count_nonzero(expected.p) < h.size or boundary == "free":
        controls.append(Approach(expected.d))
    for control in controls:
        found = found_by_sets(solver(h, **options), h, control)
        assert found.converged
        assert found.certificate.worst <= TIGHT
        assert_allclose(found.p, expected.p, rtol=0, atol=1e-9 * expected.p.max())
        assert_allclose(found.d, expected.d, rtol=0, atol=1e-9 * np.ptp(h))


SCENES = [(seed, stretch) for seed in (1, 2, 3) for stretch in (1e-4, 1e-3, 1e3, 1e4)]


@pytest.mark.parametrize(("seed", "stretch"), SCENES)
@pytest.mark.parametrize("control", ["load", "approach"])
def test_cells_much_longer_than_wide(seed: int, stretch: float, control: str) -> None:
    """White noise on boxes of up to 10 000 : 1, where projected steps stall or take thousands; half way to full
    contact."""
    h = white((16, 16), seed)
    body = solver(h, (1.0, stretch), tolerance=1e-8)
    pressure = body.preconditioner.apply(h - h.mean(), np.empty_like(h))
    half: MeanPressure | Approach = MeanPressure(-0.5 * pressure.min()) if control == "load" else Approach(-h.max() / 2)
    found = found_by_sets(body, h, half)
    assert found.converged
    assert found.certificate.worst <= 1e-8
    assert found.p.min() >= 0.0
    gap = body.operator.apply(found.p, np.empty_like(h)) - h - found.d
    assert gap.min() >= -1.1e-8 * np.ptp(h)


def test_from_full_contact_to_none() -> None:
    """A given approach that touches nowhere, from pressure everywhere: a uniform pressure moves a periodic body
    nowhere, so that nothing says how far to go."""
    h = rough(64)
    body = solver(h)
    found = found_by_sets(body, h, Approach(-1.01 * h.max()), 1.0)
    assert found.converged
    assert np.all(found.p == 0.0)
    assert found.iterations == 0  # what would not penetrate the undeformed body is no set to begin with


def test_on_a_set_the_load_is_kept_and_the_gap_is_closed() -> None:
    """From a start with half of the load on the set, and as much outside: the load to rounding, the gap to what was
    asked for, nothing outside; in some ten conjugate directions, of which each would change the load by itself."""
    h, load = rough(64), MeanPressure(0.5)
    body = solver(h)
    x = np.full_like(h, 0.5)
    search = active_set._Search(body.solver, body.problem(h, load), x)
    search.working = h > 0.5 * h.max()
    u = np.empty_like(h)
    assert 5 < search.solve_on_set(u, 1e-9) < 50
    assert_allclose(x.sum(), 0.5 * h.size, rtol=1e-13)
    assert_allclose((u - h)[search.working], search.d, rtol=0, atol=1.001e-9)
    assert np.all(x[~search.working] == 0.0)


def test_it_says_when_it_has_found_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(active_set, "MAX_SETS", 1)
    h = rough(64)
    found = found_by_sets(solver(h), h, MeanPressure(0.1))
    assert found.failure == "found no contact among 1 sets of points"
    assert found.certificate.worst > 1e-6


@pytest.mark.mpi
@pytest.mark.parametrize("control", [MeanPressure(0.4), Approach(-0.01)])
def test_any_number_of_ranks(comm: MPI.Intracomm, control: MeanPressure | Approach) -> None:
    """To 1e-9 of the highest pressure, on cells of 100 : 1; some ranks may have no rows."""

    def solved(on: MPI.Intracomm) -> tuple[Slab, Any]:
        slab = Slab(on, 24, 3)
        fft, size = FFT(slab), (1.0, 12.5)
        h = slab.empty()
        h[...] = white((3, 24), 5)[slab.rows]
        solving = ContactSolver(Workspace(slab, 1e-11), 1.0, 1e-11, 500)
        body = Bench(solving, HalfSpace(size).operator(fft), HalfSpace(size).inverse(fft))
        return slab, found_by_sets(body, h, control)

    slab, together = solved(comm)
    _, alone = solved(MPI.COMM_SELF)
    assert together.converged
    assert alone.converged
    assert_allclose(together.p, alone.p[slab.rows], rtol=0, atol=1e-9 * alone.p.max())
