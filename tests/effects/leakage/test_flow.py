"""Flow through gaps: closed forms of waves, mazes and checkerboards, closure, and what rotations and scales do."""

import heapq
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from parcontact.effects.leakage.flow import (
    FLUIDS,
    Balance,
    FloatMap,
    Fluid,
    PressureDrop,
    critical_constriction,
    flow_mesh_error,
    leak,
    least_section,
    solve_flow,
)
from parcontact.errors import InputError


def wave(points: int, depth: float) -> FloatMap:
    """Gaps 1 + depth cos(2 pi x), the same along y."""
    x = (np.arange(points) + 0.5) / points
    return np.broadcast_to(1.0 + depth * np.cos(2.0 * np.pi * x), (points, points)).copy()


def test_flow_along_the_crests_of_a_wave() -> None:
    """K = h0^3 (1 + 1.5 eps^2): the mean of g^3, which the midpoint rule gives to round-off."""
    assert solve_flow(wave(64, 0.5), (1.0, 1.0), "y").conductivity == pytest.approx(1.375, rel=1e-12)


def test_flow_across_the_crests_of_a_wave() -> None:
    """K = h0^3 (1 - eps^2)^2.5 / (1 + eps^2 / 2): 1 over the mean of 1/g^3; the error falls faster than any power."""
    exact = 0.75**2.5 / 1.125
    assert solve_flow(wave(64, 0.5), (1.0, 1.0), "x").conductivity == pytest.approx(exact, rel=1e-12)


def test_error_by_the_mesh() -> None:
    """Gaps in a row resist one after the other: K = n/sum(1/g^3), of the even ones and of the odd ones identical. Side
    by side K is the mean of g^3. Where contact closes no error is known."""
    gaps = np.random.default_rng(1).uniform(0.5, 1.5, 32)
    gap = np.broadcast_to(gaps, (8, 32))
    whole, even, odd = (len(each) / float(np.sum(each**-3.0)) for each in (gaps, gaps[::2], gaps[1::2]))
    found = flow_mesh_error(gap, solve_flow(gap, (2.0, 1.0)), (2.0, 1.0))
    assert found == pytest.approx(max(abs(even / whole - 1.0), abs(odd / whole - 1.0)), rel=1e-12)
    assert found > 1e-3
    row = gap[:1]
    assert flow_mesh_error(row, solve_flow(row, (2.0, 1.0)), (2.0, 1.0)) == pytest.approx(found, rel=1e-12)
    whole, even, odd = (float(np.mean(each**3.0)) for each in (gaps, gaps[::2], gaps[1::2]))
    alongside = flow_mesh_error(gap, solve_flow(gap, (2.0, 1.0), "y"), (2.0, 1.0), "y")
    assert alongside == pytest.approx(max(abs(even / whole - 1.0), abs(odd / whole - 1.0)), rel=1e-12)
    assert np.isnan(flow_mesh_error(0.0 * gap, solve_flow(0.0 * gap, (2.0, 1.0)), (2.0, 1.0)))


def checkerboard(points: int, second: float) -> FloatMap:
    """Conductivities g^3 of 1 and `second`, in 2 x 2 squares whose middles lie on the ends, lines of one pressure."""
    side = ((np.arange(points) + points // 4) * 2 // points) % 2
    return np.cbrt(np.where((side[:, None] + side) % 2 == 0, 1.0, second))


def test_checkerboard() -> None:
    """K = sqrt(s1 s2), at order 2 pi / angle - 1 of the singularities in the corners: 1.5 for 1 and 2."""
    errors = [solve_flow(checkerboard(n, 2.0), (1.0, 1.0)).conductivity / np.sqrt(2.0) - 1.0 for n in (32, 64, 128)]
    assert abs(errors[-1]) < 3e-4
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (np.abs(orders - 1.5) < 0.1).all()


def test_a_maze_with_a_single_path() -> None:
    """One cell wide from end to end: the sum of 1/g^3 over its cells is the resistance."""
    gap, generator = np.zeros((7, 5)), np.random.default_rng(1)
    path = [(0, 1), (1, 1), (1, 2), (1, 3), (2, 3), (3, 3), (3, 2), (3, 1), (4, 1), (5, 1), (6, 1)]
    for cell in path:
        gap[cell] = generator.uniform(0.2, 1.0)
    cubes = np.array([gap[cell] ** 3 for cell in path])
    flow = solve_flow(gap, (5.0, 7.0), "y", periodic_sides=False)
    assert flow.conductivity == pytest.approx(7.0 / 5.0 / np.sum(1.0 / cubes), rel=1e-12)
    assert gap[flow.position or (0, 0)] == flow.constriction == gap[gap > 0.0].min()
    turned = solve_flow(gap.T, (7.0, 5.0), "x", periodic_sides=False)
    assert turned.conductivity == pytest.approx(flow.conductivity, rel=1e-12)


def test_sides_are_periodic_or_closed() -> None:
    """A channel that leaves on one side and comes back on the other leads through periodic sides only."""
    gap = np.zeros((4, 6))
    gap[:2, 0] = gap[2:, 5] = 1.0
    gap[2, 5] = gap[1, 0] = 1.0
    gap[1, 5] = 1.0  # next to (1, 0) across the side
    assert solve_flow(gap, (1.0, 1.0), "y", periodic_sides=True).percolates
    assert not solve_flow(gap, (1.0, 1.0), "y", periodic_sides=False).percolates


def test_narrow_gaps_hardly_matter() -> None:
    """Cells below a thousandth of the largest gap are closed: they could carry a 1e-9 of what others carry."""
    gap = np.maximum(np.random.default_rng(4).normal(0.5, 0.4, (32, 32)), 0.0)
    with_narrow = np.where(gap == 0.0, 5e-4 * gap.max(), gap)
    closed, leaking = (solve_flow(g, (1.0, 1.0)).conductivity for g in (gap, with_narrow))
    assert closed == leaking
    all_narrow = np.full((8, 8), 1e-5)
    all_narrow[3, 3] = 1.0  # where all paths are narrow they are kept
    assert solve_flow(all_narrow, (1.0, 1.0)).conductivity == pytest.approx(1e-15, rel=0.2)


@pytest.mark.parametrize(
    ("gap", "size", "stated"),
    [
        ([["a"]], (1.0, 1.0), "got values of type <U1"),
        ([[1.0], [1.0, 2.0]], (1.0, 1.0), "gap must be a map of numbers"),
        (None, (1.0, 1.0), "got values of type object"),
        (np.ones((4, 4)) * 1j, (1.0, 1.0), "map of real numbers .*, got values of type complex128"),
        (np.ones((4, 4)).astype("M8[s]"), (1.0, 1.0), r"got values of type datetime64\[s\]"),
        (np.ones((4, 4)).astype("m8[s]"), (1.0, 1.0), r"got values of type timedelta64\[s\]"),
        (np.ones((4, 4)) > 0.0, (1.0, 1.0), "got values of type bool"),
        (np.ma.masked_greater(np.eye(4), 0.5), (1.0, 1.0), "4 of 16 points are masked: fill or close"),
        (np.full((4, 4), 1e103), (1.0, 1.0), r"its largest value is 1e\+103 m; 1e-70 to 1e\+70 m were expected"),
        (np.ones(5), (1.0, 1.0), r"shape \(5,\)"),
        (np.ones((0, 3)), (1.0, 1.0), r"shape \(0, 3\)"),
        ([[1.0, np.nan]], (1.0, 1.0), "1 of 2 points are not: fill or close"),
        (np.ones((4, 4)), 1.0, "two lengths .*, got 1.0"),
        (np.ones((4, 4)), (1.0, 1.0, 1.0), "two lengths"),
        (np.ones((4, 4)), (1.0, -1.0), "positive lengths"),
        (np.ones((4, 4)), (1.0, np.nan), "positive lengths"),
    ],
)
def test_what_is_no_map_of_gaps(gap: Any, size: Any, stated: str) -> None:
    with pytest.raises(InputError, match=stated):
        leak(gap, size)


def test_what_a_leak_shows() -> None:
    """A notebook prints its numbers, not its maps."""
    assert len(repr(leak(np.ones((64, 64)).tolist(), [1.0, 1.0]))) < 300


# -- flow of liquids and gases through an even gap, against closed forms, and the sentences on them -------------------

SIZE, GAP = (2e-3, 1e-3), 1e-6  # [m]
EVEN = np.full((4, 8), GAP)


def rate(drop: PressureDrop) -> float:
    flow = solve_flow(drop.conducting_gap(EVEN, drop.pressures[0]), SIZE)
    return drop.flow_rate(flow.conductivity, *SIZE)


def test_a_liquid() -> None:
    """Plane Poiseuille flow, h^3/(12 eta) (p1 - p2) W/L, to rounding."""
    found = rate(PressureDrop(Fluid("oil", 0.1), 3e5, 1e5))
    assert found == pytest.approx(GAP**3 / (12 * 0.1) * 2e5 * SIZE[1] / SIZE[0], rel=1e-12)


@pytest.mark.parametrize("name", ["air", "nitrogen", "helium"])
def test_a_gas_that_expands_and_slips(name: str) -> None:
    """As many molecules pass each place: with the slip length lambda(p) the integral of `h^3 p (1 + 6 lambda/h) dp/eta`
    from p2 to p1, here by 2000 trapezoids (exact, as it is linear in p: 1e-9)."""
    fluid, high, low = FLUIDS[name], 3e5, 1e4
    p = np.linspace(low, high, 2001)
    slip = 1.0 + 6.0 * np.array([fluid.mean_free_path(each) for each in p]) / GAP
    density = GAP**3 * p * slip
    passing = float(0.5 * (density[1:] + density[:-1]) @ np.diff(p))
    exact = passing / (12.0 * fluid.viscosity) / low * SIZE[1] / SIZE[0]
    assert rate(PressureDrop(fluid, high, low)) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize(("name", "path"), [("air", 66e-9), ("nitrogen", 65e-9), ("helium", 192e-9)])
def test_mean_free_paths(name: str, path: float) -> None:
    """Those of tables at 20 C and 1 bar, which differ by some per cent (air 66 to 68 nm, helium 190 to 198 nm)."""
    assert FLUIDS[name].mean_free_path(1e5) == pytest.approx(path, rel=0.03)


# -- connected cells and critical constrictions against a search that grows from the first row ------------------------


def widest_path(gap: NDArray[np.float64], periodic: bool) -> float:
    """The smallest gap on the widest path, by Dijkstra's algorithm."""
    rows, columns = gap.shape
    best = np.zeros_like(gap)
    queue = [(-float(g), 0, j) for j, g in enumerate(gap[0]) if g > 0.0]
    heapq.heapify(queue)
    while queue:
        width, i, j = heapq.heappop(queue)
        if best[i, j] >= -width:
            continue
        best[i, j] = -width
        for a, b in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
            if periodic:
                b %= columns
            if 0 <= a < rows and 0 <= b < columns:
                heapq.heappush(queue, (max(width, -float(gap[a, b])), a, b))
    return float(best[-1].max())


@pytest.mark.parametrize("periodic", [True, False])
def test_the_constriction_is_that_of_the_widest_path(periodic: bool) -> None:
    generator, closed = np.random.default_rng(5), 0
    for share in np.linspace(0.2, 0.6, 40):
        gap = np.where(generator.uniform(size=(9, 11)) < share, 0.0, generator.uniform(size=(9, 11)))
        found, position = critical_constriction(gap, periodic)
        assert found == widest_path(gap, periodic)
        closed += position is None
        assert position is None or gap[position] == found
    assert 0 < closed < 40  # both happen


# -- elimination of half of the cells against a dense solution, for odd and even, narrow and wide maps ----------------


def dense(cubes: FloatMap, aspect: float, periodic: bool, given: FloatMap) -> FloatMap:
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


def test_sides_that_are_periodic_along_x_alone() -> None:
    """Flow along y has them at its sides, flow along x has the free ones."""
    gap = np.random.default_rng(3).uniform(0.0, 1.0, (12, 16))
    one, all_, none = (leak(gap, (1.0, 1.0), periodic) for periodic in ((True, False), True, False))
    assert one.flow_x == none.flow_x != all_.flow_x
    assert one.flow_y == all_.flow_y != none.flow_y


@pytest.mark.parametrize(("high", "length", "gap"), [(6e5, 2e-3, 17e-6), (20e5, 1e-3, 6.5e-6)])
def test_inertia_bounds_the_flow_of_a_gas(high: float, length: float, gap: float) -> None:
    """Viscous flow between even walls, h^3 (p1^2 - p2^2) M/(24 eta R T L), reaches the choked flow of a nozzle,
    h p1 sqrt(kappa M/(R T)) (2/(kappa + 1))^((kappa + 1)/(2 (kappa - 1))), at the gaps of its closed form, stated to
    two digits."""
    drop = PressureDrop(FLUIDS["nitrogen"], high, 1e5)
    speed = np.sqrt(8.314462618 * 293.15 / 0.028014)
    choked = np.sqrt(1.4) * (2 / 2.4) ** 3 * high / speed
    assert drop.inertial_bound(gap) == pytest.approx(gap * choked, rel=1e-6)
    exact = np.sqrt(choked * 24 * 1.76e-5 * length * speed**2 / (high**2 - 1e10))
    assert exact == pytest.approx(gap, rel=0.015)
    assert drop.mass_flow(exact**3, length, 1.0) == pytest.approx(drop.inertial_bound(exact), rel=1e-6)


def test_slow_gas_flows_by_bernoulli() -> None:
    """A small drop dp gives sqrt(2 rho dp) per section, to the order of dp/p; a liquid has no bound."""
    drop = PressureDrop(FLUIDS["air"], 1.0001e5, 1e5)
    density = 1e5 * 0.028964 / (8.314462618 * 293.15)
    assert drop.inertial_bound(1.0) == pytest.approx(np.sqrt(2 * density * 10.0), rel=1e-3)
    assert PressureDrop(FLUIDS["water"], 2e5, 1e5).inertial_bound(1.0) == np.inf


def test_smallest_open_section() -> None:
    """A channel with one narrow column: the closed pool next to it does not count."""
    gap = np.zeros((6, 4))
    gap[:3], gap[:3, 2], gap[4, 0] = 2e-6, 1e-6, 5e-6
    flow, turned = solve_flow(gap, (4e-3, 6e-3), "x"), solve_flow(gap.T, (6e-3, 4e-3), "y")
    assert least_section(gap, flow, (4e-3, 6e-3), "x") == pytest.approx(3e-9)
    assert least_section(gap.T, turned, (6e-3, 4e-3), "y") == pytest.approx(3e-9)
    assert least_section(gap, solve_flow(gap, (4e-3, 6e-3), "y"), (4e-3, 6e-3), "y") == 0.0
