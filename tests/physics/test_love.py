"""Love's influence coefficients against quadrature, a series far away, and themselves."""

import math
from itertools import pairwise, product

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from rubbers import complex_modulus
from scipy.integrate import dblquad, quad

from parcontact.errors import InputError
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab, Tally
from parcontact.physics import convolution
from parcontact.physics import halfspace as wake
from parcontact.physics.convolution import SIDE, Tiles
from parcontact.physics.halfspace import HalfSpace, love
from parcontact.physics.prony import Prony, creep_spectrum

from .maps import gathered, random_map


@pytest.mark.parametrize("aspect", [1.0, 0.1, 30.0])
@pytest.mark.parametrize(("i", "j"), [(0, 0), (1, 0), (0, 1), (2, 3), (3.5, 0.0), (4.5, 2.25), (0.5, 9.0), (60, 7)])
def test_love_against_quadrature(i: float, j: float, aspect: float) -> None:
    """The integral of 1/r over the cell, in polar coordinates where the cell contains the origin."""
    x, y, dx, dy = i, j * aspect, 1.0, aspect
    if (i, j) == (0, 0):
        # Over the rectangle, int dphi r(phi): four triangles with legs dx/2, dy/2.
        expected = 2 * (dy / 2 * np.arcsinh(dx / dy) + dx / 2 * np.arcsinh(dy / dx)) * 2
    else:
        edges = x - dx / 2, x + dx / 2, y - dy / 2, y + dy / 2
        expected = dblquad(lambda b, a: 1 / math.hypot(a, b), *edges, epsabs=0, epsrel=1e-11)[0]
    assert_allclose(love(np.array(x), np.array(y), dx, dy), expected / (4 * np.pi), rtol=1e-10)


def test_cells_add_up() -> None:
    """A cell is the sum of its four quarters, near and far."""
    for i, j, aspect in product([0, 1, 4, 50], [0, 2, 5, 1000], [1.0, 20.0]):
        quarters = [(i + a, (j + b) * aspect) for a in (-0.25, 0.25) for b in (-0.25, 0.25)]
        x, y = np.array(quarters).T
        whole = love(np.array(float(i)), np.array(j * aspect), 1.0, aspect)
        assert_allclose(love(x, y, 0.5, aspect / 2).sum(), whole, rtol=2e-14)


# -- operators of steady sliding against integrals along the wake, and against the body's own relaxation --------------

BODY = Prony(0.3, np.array([2.0, 0.7]), np.array([0.05, 2.0]))
CREEP = creep_spectrum(*BODY)
CELL = (0.1, 0.07)


def along_the_wake(x: float, y: float, velocity: tuple[float, float]) -> float:
    """`J_g A(x) + sum J_i int exp(-t/l_i)/l_i A(x + v t) dt` with Love's A, by adaptive quadrature in units of l_i."""

    def deflection(t: float) -> float:
        return float(love(np.array(x + velocity[0] * t), np.array(y + velocity[1] * t), *CELL))

    total = CREEP.glass * deflection(0.0)
    for compliance, time in zip(CREEP.compliances, CREEP.retardation_times, strict=True):
        nearest = -(x * velocity[0] + y * velocity[1]) / float(np.dot(velocity, velocity)) / time
        points = sorted({0.0, *(p for p in (nearest - 0.05, nearest, nearest + 0.05) if 0.0 < p < 40.0), 40.0})
        for start, stop in pairwise(points):
            part = quad(lambda s, time=time: np.exp(-s) * deflection(s * time), start, stop, epsabs=1e-12, limit=400)
            total += compliance * part[0]
    return total


@pytest.mark.parametrize("velocity", [(0.02, 0.0), (1.0, 0.0), (-0.3, 0.4), (0.0, 50.0)])
def test_coefficients_are_integrals_along_the_wake(velocity: tuple[float, float]) -> None:
    """To 1e-5, what six Gauss nodes per panel leave at the edge of the loaded cell; on it, before it, in its wake."""
    places = np.array([(0.0, 0.0), (0.05, 0.035), (0.3, 0.0), (-0.3, 0.14), (-2.0, -1.0), (1.0, 3.0)])
    found = wake.wake(places[None, :, 0], places[None, :, 1], *CELL, velocity, CREEP)[0]
    expected = [along_the_wake(float(x), float(y), velocity) for x, y in places]
    assert_allclose(found, expected, rtol=1e-5)


@pytest.mark.parametrize("velocity", [(0.02, 0.0), (-1.0, 0.0)])
def test_rows_along_the_velocity(velocity: tuple[float, float]) -> None:
    """Whole rows, calculated from cell to cell, agree with each cell: to 1e-5 as above."""
    x, y = CELL[0] * np.array([0.0, 1.0, 2.0, -2.0, -1.0]), CELL[1] * np.array([0.0, 1.0])
    found = wake.wake(x[None, :], y[:, None], *CELL, velocity, CREEP)
    expected = [[along_the_wake(float(a), float(b), velocity) for a in x] for b in y]
    assert_allclose(found, expected, rtol=1e-5)


def test_far_coefficients_are_those_of_point_loads() -> None:
    """Love's displacement far away is that of a point load, `dx dy/(4 pi r)`, to the fourth power of cell over distance
    when two terms of its expansion are taken: here along the whole wake, to 1e-6."""
    velocity = (0.4, 0.1)
    x, y = 4.0, 3.0

    def point(t: float) -> float:
        return CELL[0] * CELL[1] / (4 * np.pi * np.hypot(x + velocity[0] * t, y + velocity[1] * t))

    expected = CREEP.glass * point(0.0)
    for compliance, time in zip(CREEP.compliances, CREEP.retardation_times, strict=True):
        expected += compliance * quad(lambda s, time=time: np.exp(-s) * point(s * time), 0.0, 40.0)[0]
    found = wake.wake(np.array([[x]]), np.array([[y]]), *CELL, velocity, CREEP)
    assert_allclose(found, expected, rtol=(max(CELL) / 5.0) ** 2)


@pytest.mark.mpi
@pytest.mark.parametrize("velocity", [(0.7, 0.0), (0.3, -0.4)])
def test_periodic_is_the_symbol(comm: MPI.Intracomm, velocity: tuple[float, float]) -> None:
    """Against numpy's complex transform of the whole map with `1/(2 |q| G*(-q v))`, to rounding; the Nyquist wave,
    which has two signs, takes the mean of both. The inverse undoes it but for the mean."""
    nx, ny, size = 12, 9, (1.5, 0.8)
    slab = Slab(comm, nx, ny)
    fft = FFT(slab)
    half_space = HalfSpace(size)
    forward = half_space.sliding_operator(fft, velocity, BODY)
    inverse = half_space.sliding_inverse(fft, velocity, BODY)
    p = random_map(nx, ny)
    own = slab.empty()
    own[...] = p[slab.rows]
    qx = 2 * np.pi / size[0] * np.fft.fftfreq(nx, 1 / nx)[None, :]
    qy = 2 * np.pi / size[1] * np.fft.fftfreq(ny, 1 / ny)[:, None]
    modulus = complex_modulus(-(qx * velocity[0] + qy * velocity[1]), *BODY)
    other = complex_modulus(-(-qx * velocity[0] + qy * velocity[1]), *BODY)
    modulus[:, nx // 2] = 0.5 * (modulus + other)[:, nx // 2]
    q = np.hypot(qx, qy)
    symbol = np.divide(0.5, q * modulus, out=np.zeros((ny, nx), complex), where=q > 0)
    expected = np.fft.ifft2(symbol * np.fft.fft2(p)).real
    u = forward.apply(own, slab.empty())
    assert_allclose(gathered(u, slab), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    back = gathered(inverse.apply(u, slab.empty()), slab)
    assert_allclose(back - back.mean(), p - p.mean(), rtol=0, atol=1e-12)


@pytest.mark.mpi
def test_free_is_the_sum_of_coefficients(comm: MPI.Intracomm) -> None:
    """Against the double sum over all pairs of cells, to rounding; what is upstream stays so, nothing wraps around."""
    nx, ny, size, velocity = 7, 5, (0.7, 0.35), (0.5, 0.2)
    slab = Slab(comm, nx, ny)
    p = random_map(nx, ny)
    own = slab.empty()
    own[...] = p[slab.rows]
    operator = HalfSpace(size, free=True).sliding_operator(FFT(slab), velocity, BODY)
    u = gathered(operator.apply(own, slab.empty()), slab)
    x, y = (0.1 * np.arange(nx))[None, :], (0.07 * np.arange(ny))[:, None]
    expected = np.zeros((ny, nx))
    for j in range(ny):
        for i in range(nx):
            expected += p[j, i] * wake.wake(x - x[0, i], y - y[j, 0], *CELL, velocity, CREEP)
    assert_allclose(u, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_waits_for_no_endless_wake() -> None:
    half_space, fft = HalfSpace((1.0, 1.0), free=True), FFT(Slab.alone(4, 4))
    with pytest.raises(InputError, match="endless wake"):
        half_space.sliding_operator(fft, (1.0, 0.0), Prony(0.0, np.ones(1), np.ones(1)))


# -- operators on tiles do what those of the whole box do -------------------------------------------------------------

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
    monkeypatch.setattr(convolution, "NODES", nodes)
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


def test_inverse_on_adjacent_tiles() -> None:
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
