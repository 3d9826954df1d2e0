"""Random maps for tests of fused loops."""

import numpy as np
import pytest
from numpy.typing import NDArray

SHAPES = pytest.mark.parametrize("shape", [(7, 33), (1, 1), (3, 64), (0, 16)])
ROUNDING = {np.float64: 1e-15, np.float32: 1e-6}  # of what is written into maps
SUMMING = {np.float64: 1e-13, np.float32: 1e-6}


class Maps:
    """Random maps: a pressure with zeros, others without, and a working set."""

    def __init__(self, shape: tuple[int, int], dtype: type[np.floating]) -> None:
        random = np.random.default_rng(1)
        self.dtype = dtype
        self.p = np.maximum(random.standard_normal(shape), 0.0).astype(dtype)
        self.u, self.h, self.t, self.z, self.r, self.old = (
            random.standard_normal(shape).astype(dtype) for _ in range(6)
        )
        self.working = random.random(shape) < 0.5

    def wide(self, name: str) -> NDArray[np.float64]:
        return np.asarray(getattr(self, name), dtype=np.float64)

    def close(self, found: float, terms: NDArray[np.float64]) -> bool:
        """Whether a number is the sum of these."""
        return bool(abs(found - terms.sum()) <= SUMMING[self.dtype] * np.abs(terms).sum())
