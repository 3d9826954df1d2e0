"""The same contact, moved or mirrored, by the contact solver: two solves to 1e-11 agree to 1e-9 of the largest."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from .bodies import BODIES, TIGHT, solve, white


@pytest.mark.parametrize(("boundary", "kernel"), BODIES)
def test_mirror_images_and_transposition(boundary: str, kernel: str) -> None:
    h = white((24, 36))
    options: dict[str, Any] = {"boundary": boundary, "kernel": kernel, "tolerance": TIGHT}
    found = solve(h, 2.0, size=(1.5, 1.0), **options)
    limit = 1e-9 * found.p.max()
    assert_allclose(solve(h[:, ::-1].copy(), 2.0, size=(1.5, 1.0), **options).p[:, ::-1], found.p, atol=limit)
    assert_allclose(solve(h[::-1].copy(), 2.0, size=(1.5, 1.0), **options).p[::-1], found.p, atol=limit)
    assert_allclose(solve(h.T.copy(), 2.0, size=(1.0, 1.5), **options).p.T, found.p, atol=limit)


def test_whole_cell_shifts() -> None:
    h = white((24, 36))
    found = solve(h, 2.0, tolerance=TIGHT)
    moved = solve(np.roll(h, (5, 7), axis=(0, 1)), 2.0, tolerance=TIGHT)
    assert_allclose(moved.p, np.roll(found.p, (5, 7), axis=(0, 1)), atol=1e-9 * found.p.max())
