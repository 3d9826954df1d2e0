"""Elimination of half of the cells against a dense solution, for odd and even, narrow and wide maps."""

import numpy as np
import pytest
from numpy.typing import NDArray

from parcontact.leakage.elimination import Balance

Map = NDArray[np.float64]


def dense(cubes: Map, aspect: float, periodic: bool, given: Map) -> Map:
    """The pressures by a full matrix, made face by face."""
    (ny, nx), number = cubes.shape, np.arange(cubes.size).reshape(cubes.shape)
    matrix = np.zeros((cubes.size, cubes.size))

    def connect(a: int, b: int, c: float) -> None:
        matrix[a, a] += c
        matrix[b, b] += c
        matrix[a, b] -= c
        matrix[b, a] -= c

    for i in range(ny):
        for j in range(nx):
            for k, m, ratio in ((i + 1, j, aspect), (i, j + 1, 1.0 / aspect)):
                if k < ny and (m < nx or periodic):
                    a, b = cubes[i, j], cubes[k, m % nx]
                    connect(number[i, j], number[k, m % nx], ratio * 2 * a * b / (a + b) if a * b else 0.0)
    for row in (0, -1):
        matrix[number[row], number[row]] += 2.0 * aspect * cubes[row]
    wet = cubes.ravel() > 0.0
    found = np.zeros(cubes.size)
    found[wet] = np.linalg.solve(matrix[np.ix_(wet, wet)], given.ravel()[wet])
    return found.reshape(cubes.shape)


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("shape", [(6, 8), (7, 7), (5, 1), (5, 2), (1, 6), (4, 3)])
def test_pressures_are_those_of_the_full_matrix(shape: tuple[int, int], periodic: bool) -> None:
    """To rounding, with what is given to any cell. Cells between columns without walls reach both ends."""
    random = np.random.default_rng(1)
    cubes = random.uniform(0.1, 1.0, shape)
    if shape[1] > 3:
        cubes[1:-1, 2] = 0.0
    given = np.where(cubes > 0.0, random.normal(size=shape), 0.0)
    with np.errstate(divide="ignore"):
        found = Balance(1.0 / cubes, 0.7, periodic).solve(given)
    np.testing.assert_allclose(found, dense(cubes, 0.7, periodic, given), rtol=0, atol=1e-13)
