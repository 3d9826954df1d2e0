"""The operator from tractions along the surface to displacements, against its symbol for single waves."""

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.effects.stick.solver import ShearOperator, components, stacked
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab

NX, NY, SIZE, POISSON = 16, 12, (1.0, 1.5), 0.5


@pytest.mark.mpi(2, 3, 4)
@pytest.mark.parametrize("waves", [(3, 0), (0, 2), (2, 1), (-3, 4)])
def test_waves_along_and_across_their_direction(waves: tuple[int, int]) -> None:
    """A wave of tractions along its wave vector moves the surface by `(1 - nu)/q` times itself, one across by `1/q`: to
    rounding, also for oblique waves, where both components are coupled."""
    slab = Slab(MPI.COMM_WORLD, NX, NY)
    both = stacked(slab)
    field, out = both.zeros(), both.zeros()
    q = 2 * np.pi * np.array(waves) / SIZE
    size = float(np.hypot(*q))
    x, y = np.arange(NX) / NX, np.arange(NY)[slab.rows, None] / NY
    wave = np.cos(2 * np.pi * (waves[0] * x + waves[1] * y) + 0.3)
    operator = ShearOperator(FFT(slab), SIZE, POISSON, free=False)
    for direction, compliance in ((q / size, 1 - POISSON), (np.array([-q[1], q[0]]) / size, 1.0)):
        for part, share in zip(components(field), direction, strict=True):
            part[...] = share * wave
        operator.apply(field, out)
        for part, share in zip(components(out), direction, strict=True):
            np.testing.assert_allclose(part, compliance / size * share * wave, rtol=0, atol=1e-14)
