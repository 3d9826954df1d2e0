"""The solver's guarantee where it is needed: on cells far longer than wide the preconditioner is far from the inverse,
and steps that raise the energy do occur; they are halved.
"""

import numpy as np
import pytest
from solve.bodies import solver, white

from parcontact.solve.problem import MeanPressure


@pytest.mark.parametrize(("aspect", "load"), [(2e3, 0.1), (1e-3, 50.0)])
def test_energy_never_rises(aspect: float, load: float) -> None:
    """Over all iterations of a solve of noise on a box of length 1 and width `aspect`; but for rounding."""
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
