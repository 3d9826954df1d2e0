"""Operators on tiles do what those of the whole box do."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.parallel.tally import Tally
from parcontact.physics import tile_operator as module
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.tiles import SIDE, Tiles

ERROR = 2e-7  # of the largest displacement: (1/FINENESS)^ORDER/5 of two interpolations, and erfc(REACH)


def stacked(tiles: Tiles, field: np.ndarray) -> np.ndarray:
    """The tiles of a map, which is 0 beyond its end."""
    whole = np.zeros((tiles.numbers.shape[0] * SIDE, tiles.numbers.shape[1] * SIDE))
    whole[: field.shape[0], : field.shape[1]] = field
    corners = zip(tiles.rows * SIDE, tiles.columns * SIDE, strict=True)
    return np.concatenate([whole[j : j + SIDE, i : i + SIDE] for j, i in corners])


@pytest.mark.parametrize(
    ("points", "size", "nodes"),
    [((200, 330), (1.0, 1.65), 256), ((330, 200), (1.0, 1.0), 256), ((384, 512), (0.75, 1.0), 64)],
    ids=["ends cut off", "long cells", "distant nodes"],
)
def test_displacement_is_that_of_the_whole_box(
    points: tuple[int, int], size: tuple[float, float], nodes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Under a random pressure on scattered tiles, near each other and far apart, on these and at all points; it is
    symmetric, too."""
    monkeypatch.setattr(module, "NODES", nodes)
    nx, ny = points
    tiles = Tiles(points, np.array([0, 0, 1, 3, (ny - 1) // SIDE]), np.array([0, 1, 4, 2, (nx - 1) // SIDE]))
    marked = stacked(tiles, np.ones((ny, nx)))
    rng, body = np.random.default_rng(1), HalfSpace(size, free=True)
    p, q = (rng.random(tiles.shape) * marked for _ in range(2))
    whole = np.zeros((tiles.numbers.shape[0] * SIDE, tiles.numbers.shape[1] * SIDE))
    for number, (row, column) in enumerate(zip(tiles.rows * SIDE, tiles.columns * SIDE, strict=True)):
        whole[row : row + SIDE, column : column + SIDE] = p[number * SIDE : (number + 1) * SIDE]
    pressure = np.ascontiguousarray(whole[:ny, :nx])
    expected = body.operator(FFT(Slab.alone(nx, ny), measured=False)).apply(pressure, np.empty((ny, nx)))
    operator, _ = body.on_tiles(tiles, tally := Tally())
    u, v = operator.apply(p, np.empty_like(p)), operator.apply(q, np.empty_like(q))
    assert_allclose(u * marked, stacked(tiles, expected), rtol=0.0, atol=ERROR * expected.max())
    parts, held = list[np.ndarray](), tally["map bytes"]
    operator.displace(p, [slice(0, 7), slice(7, 7), slice(7, 70), slice(70, ny)], lambda _, rows: parts.append(rows))
    assert tally["map bytes"] - held == expected.nbytes  # of all parts, which are kept here
    assert_allclose(np.concatenate(parts), expected, rtol=0.0, atol=ERROR * expected.max())
    assert np.vdot(q, u) == pytest.approx(np.vdot(p, v), rel=1e-12)


def test_inverse_on_tiles_beside_each_other() -> None:
    """It is that of a periodic box of eight tiles, for a pressure within one of the tiles: to rounding on the tiles
    around it, and nothing beyond."""
    count = 8 * SIDE
    tiles = Tiles((count, count), np.array([3, 3, 4, 6]), np.array([3, 4, 4, 3]))
    whole = np.zeros((count, count))
    whole[3 * SIDE : 4 * SIDE, 3 * SIDE : 4 * SIDE] = np.random.default_rng(1).random((SIDE, SIDE))
    transform, tally = FFT(Slab.alone(count, count), measured=False), Tally()
    zero_mean = HalfSpace((1.0, 1.0)).inverse(transform).apply(whole, np.empty_like(whole))
    expected = stacked(tiles, zero_mean - 2.0 * 2.0 * np.pi * whole.mean())  # that of the mean is 0 on tiles
    _, inverse = HalfSpace((1.0, 1.0), free=True).on_tiles(tiles, tally)
    found = inverse.apply(stacked(tiles, whole), np.empty(tiles.shape))
    assert_allclose(found[: 3 * SIDE], expected[: 3 * SIDE], rtol=0.0, atol=1e-13 * expected.max())
    assert_allclose(found[3 * SIDE :], 0.0, atol=1e-13 * expected.max())
