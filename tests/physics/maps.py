"""Maps on slabs, for tests."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from parcontact.parallel.slab import Array, Slab


def random_map(nx: int, ny: int, seed: int = 0) -> Array:
    """A whole map, the same on every rank."""
    return np.random.default_rng([seed, nx, ny]).standard_normal((ny, nx))


def gathered(field: NDArray[Any], slab: Slab) -> NDArray[Any]:
    """The whole of a map, on every rank."""
    return np.concatenate(slab.from_all(field.copy()))


def coordinates(slab: Slab, size: tuple[float, float]) -> tuple[Array, Array]:
    """x and y of this rank's points, which broadcast to a map."""
    x, y = np.arange(slab.nx) * size[0] / slab.nx, np.arange(slab.ny) * size[1] / slab.ny
    return x[None, :], y[slab.rows, None]


def product(a: Array, b: Array, slab: Slab) -> float:
    """Sum over all points of a b."""
    return slab.sum(float(np.sum(a * b)))[0]
