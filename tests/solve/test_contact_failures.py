"""What keeps the contact solver from cycling, and how it ends where there is nothing to find."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from parcontact.parallel.slab import Slab
from parcontact.solve import contact
from parcontact.solve.contact import ContactSolver
from parcontact.solve.problem import Approach, MeanPressure
from parcontact.solve.workspace import Workspace

from .bodies import Bench, rough, solver, white

# -- the safeguard -----------------------------------------------------------------------------------------------------


class Dense:
    """An operator given by its matrix."""

    def __init__(self, matrix: list[list[float]]) -> None:
        self.matrix = np.array(matrix)

    def apply(self, field: NDArray[Any], out: NDArray[Any]) -> NDArray[Any]:
        out[...] = (self.matrix @ field.ravel()).reshape(field.shape)
        return out


# Found by trial among small matrices B B' + 1 of whole numbers: no half space of ours needed the safeguard.
LOADED = [[23, -4, -23, -4, 12], [-4, 20, 2, 23, -13], [-23, 2, 29, 0, -6], [-4, 23, 0, 30, -17]]
LOADED += [[12, -13, -6, -17, 22]]
MOVED = [[28, -10, -8, -11, 4], [-10, 16, 9, -10, 9], [-8, 9, 11, -3, 3], [-11, -10, -3, 27, -16], [4, 9, 3, -16, 12]]
CYCLES = [
    (LOADED, [-5.0, -5.0, 3.0, 1.0, 3.0], MeanPressure(20.0)),
    (MOVED, [-1.0, 3.0, -2.0, -1.0, 4.0], Approach(-2.0)),
]


@pytest.mark.parametrize(("matrix", "heights", "control"), CYCLES)
def test_without_halving_steps_it_may_cycle(
    matrix: list[list[float]], heights: list[float], control: MeanPressure | Approach, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unpreconditioned, on positive definite matrices with eigenvalues from 1 to some 60."""
    h = np.array([heights])

    def attempt() -> contact.Contact:
        solving = ContactSolver(Workspace(Slab.alone(5, 1), 1e-8), 10.0, 1e-8, 500)
        body = Bench(solving, Dense(matrix), Dense(np.eye(5).tolist()))
        return body.solve(h, control, np.zeros_like(h))

    guarded = attempt()
    assert guarded.converged
    gap = np.array(matrix) @ guarded.p[0] - h[0] - guarded.d
    assert gap.min() > -1e-7
    monkeypatch.setattr(contact, "MAX_HALVINGS", 0)
    assert "stalled" in attempt().failure


@pytest.mark.parametrize("control", [MeanPressure(0.4), Approach(0.5)])
def test_every_iteration_lowers_the_energy(control: MeanPressure | Approach) -> None:
    """From a start that is nowhere near; but for rounding."""
    h, start = rough(48), white((48, 48), 3) ** 2
    energies = []
    for limit in range(1, 15):
        solving = solver(h, boundary="free", max_iterations=limit, tolerance=1e-10)
        found = solving.solve(h, control, start.copy())
        d = found.d if isinstance(control, Approach) else 0.0
        energies.append(float(np.sum(found.p * (0.5 * found.u - h - d))))
    assert np.all(np.diff(energies) <= 1e-13 * np.abs(energies[0]))


@pytest.mark.parametrize(("aspect", "load"), [(2e3, 0.1), (1e-3, 50.0)])
def test_where_steps_are_halved_the_energy_never_rises(aspect: float, load: float) -> None:
    """On cells far longer than wide, where the preconditioner is far from the inverse: over all iterations of a solve
    of noise on a box of length 1 and width `aspect`; but for rounding."""
    h = white((6, 18), 3)
    energies, halved = [], False
    for limit in range(1, 60):
        body = solver(h, size=(1.0, aspect), tolerance=1e-8, max_iterations=limit)
        found = body.solve(h, MeanPressure(load), np.zeros_like(h))
        energies.append(float(np.sum(found.p * (0.5 * found.u - h))))
        halved = body.slab.tally["operator"] > 1 + 3 * found.iterations  # each try of a step costs one more
        if found.converged:
            break
    assert np.all(np.diff(energies) <= 1e-12 * np.abs(energies).max())
    assert found.converged
    assert halved


# -- what cannot be solved ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("control", [MeanPressure(0.4), MeanPressure(0.0), Approach(0.1)])
def test_heights_that_are_not_finite(value: float, control: MeanPressure | Approach) -> None:
    h = rough(48)
    solving = solver(h)
    h[3, 4] = value
    if value == -np.inf and control == MeanPressure(0.0):
        return  # a hole without a bottom, and the highest point touches
    assert solving.solve(h, control, np.zeros_like(h)).failure == "met numbers that are not finite"


@pytest.mark.parametrize("control", [MeanPressure(np.nan), MeanPressure(np.inf), Approach(np.nan), Approach(np.inf)])
def test_loads_that_are_not_finite(control: MeanPressure | Approach) -> None:
    h = rough(48)
    assert solver(h).solve(h, control, np.zeros_like(h)).failure == "met numbers that are not finite"


def test_iterations_run_out() -> None:
    h = rough(64)
    found = solver(h, max_iterations=3).solve(h, MeanPressure(0.4), np.zeros_like(h))
    assert not found.converged
    assert found.iterations == 3
    assert found.failure.startswith("did not converge in max_iterations = 3: the residual is ")
    assert found.failure.endswith(" where 1e-06 was asked for")


@pytest.mark.parametrize("control", [MeanPressure(0.4), Approach(-0.02)])
def test_stall(control: MeanPressure | Approach) -> None:
    """More than rounding allows is refused long before the iterations run out; the last iterate is still a good one."""
    h = rough(48)
    found = solver(h, tolerance=1e-300, max_iterations=10_000).solve(h, control, np.zeros_like(h))
    assert not found.converged
    assert found.failure.startswith("stalled: no residual below ")
    assert found.iterations < 300
    assert found.certificate.worst < 1e-12
