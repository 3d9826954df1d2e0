"""Tractions of a contact that sticks and slips, by projected, preconditioned conjugate gradients on discs.

With A the operator of the body, from tractions to displacements, and bounds f of the tractions, find t with

    |t| <= f,     w = e - A t,     w = 0 where |t| < f,     w along t where |t| = f.

w is the slip in a step in which a point that sticks ends at the displacement e. The solution minimizes the convex
function `J(t) = <t, A t>/2 - <t, e>` over the product of discs |t| <= f. One iteration:

1. A point slips if its traction t was shortened to its disc and w is not opposite to t; other points stick. The
   traction of a point that slips can only turn. Both the body and the slip resist this turn: at such points A is
   replaced by `A + |w|/f`.
2. The residual r is w where points stick, and the part of w across t where points slip. The direction z is `S E' K E S
   r + (1 - S^2)/(1/kappa + |w|/f) r + k <w>`. K is close to the inverse of A, and E extends each component beyond the
   points that move along it (`preconditioner.extension`). S is 1 where points stick. Where points slip, S is the root
   of `a/(a + |w|/f)`, with the compliance a of the shortest waves. K is left out for a component with a small residual.
   <w> is the mean slip of the points that stick. In a periodic box a mean traction does not move the surface, and these
   points resist mean slip with about `k = kappa/(1 - m)`, where m is their share of the box. This is much more than K
   assumes.
3. With d the last change of t, t moves by `STEP (z + beta d) + gamma d`. beta makes z conjugate to d, and gamma
   minimizes J along d: both follow from A d, which is known. Then tractions of points that slip get the length f, and
   longer tractions are shortened to f.
4. Discs are convex, so that all tractions between the old and the new tractions are admissible. t becomes that traction
   with the least J, and A t follows without another application of A. So J never rises. If all points stick, J may be
   least far beyond the new tractions. Then K is much smaller than the inverse of A, as in a free row of long cells, and
   STEP grows.
5. If t has moved by only a small part of the change, the next iteration uses `t + kappa w`, shortened to its disc, as
   the new tractions. J always falls towards these tractions.

kappa is a stiffness of the contact as a whole. The certificate is the larger of two errors of t, divided by the sum of
|t|. One error is `sum |P(t + kappa w) - t|`, where P(t) is t shortened to its disc. The other error is the change in
step 3, in which K measures residuals of all wavelengths. The certificate is 0 only for the solution, and equals the
relative error of tractions where K is close to the inverse of A. In many small steps points would slip by these errors,
which add up. So a solve ends when the certificate is below the tolerance, and also below a share of the change of t
since the last step. A certificate of a tenth of the tolerance always suffices. `contact.solver` uses the same method
for the constraint p >= 0.

The operator A takes tractions along the surface of a half space to displacements along the surface.

A wave of tractions t, with two components, moves the surface of an elastic half space of shear modulus 1 by

    u^(q) = 1/|q| (I - nu q q^T/q^2) t^(q).

Tractions along q have the compliance of a pressure, `(1 - nu)/|q|`, tractions across q the compliance `1/|q|`. In an
incompressible half space (nu = 1/2) tractions do not move the surface along its normal, and pressures do not move the
surface along itself (K. L. Johnson, Contact Mechanics, 1985, section 3.6).

The mean displacement of a periodic half space is 0. In a free box tractions are constant on each cell, and the
displacement at a distance (x, y) from the centre of a cell is the integral of Cerruti's solution over the cell

    u_x = t_x ((1 - nu)/r + nu x^2/r^3)/(2 pi) + t_y nu x y/r^3/(2 pi),

and u_y with x and y exchanged. The displacement follows from the integrals over the cell of 1/r
(`halfspace.over_cell`), of `x^2/r^3`, with the primitive `y asinh(x/|y|)`, and of `x y/r^3`, with the primitive -r.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ...compiled import loop
from ...contact.preconditioner import ExtendedPreconditioner, Grids
from ...contact.problem import Operator
from ...parallel.fft import FFT, Spectrum
from ...parallel.slab import Array, Slab, allocate
from ...physics.convolution import padded_lengths, tabulate, travelling_wavenumbers, wavenumbers
from ...physics.halfspace import love

AT_BOUND = 1.0 - 1e-12  # rounding: share of its bound from which a traction is at it
ACROSS = 0.5  # tuning: least component of a traction across an axis, over the one along it, for moves along the axis


@loop
def shorten_to_bounds(bound, x, y, hit):
    """Shorten the tractions (x, y) to their bounds, and mark the shortened tractions in `hit`. Where the bound is 0,
    the traction becomes 0."""
    for j in range(bound.shape[0]):
        for i in range(bound.shape[1]):
            size, most = math.hypot(x[j, i], y[j, i]), bound[j, i]
            hit[j, i] = most > 0.0 and size >= AT_BOUND * most
            if most <= 0.0:
                x[j, i], y[j, i] = 0.0, 0.0
            elif size > most:
                x[j, i] *= most / size
                y[j, i] *= most / size


@loop
def extrapolate_tractions(last_x, last_y, last_bound, factor, growth, bound, mean_x, mean_y, x, y):
    """Replace the tractions (x, y) of two steps ago by tractions from which the solve of this step starts.

    First `growth` times the last change of a traction is added to the last traction. Then a traction that slipped is
    scaled to its new bound, and any other traction is multiplied by `factor`. A point that has just come into contact
    gets the share (mean_x, mean_y) of its bound.
    """
    for j in range(bound.shape[0]):
        for i in range(bound.shape[1]):
            if last_bound[j, i] <= 0.0:
                x[j, i], y[j, i] = mean_x * bound[j, i], mean_y * bound[j, i]
                continue
            a, b = last_x[j, i], last_y[j, i]
            slipped = math.hypot(a, b) >= AT_BOUND * last_bound[j, i]
            a, b = a + growth * (a - x[j, i]), b + growth * (b - y[j, i])
            size = math.hypot(a, b)
            scale = bound[j, i] / size if slipped and size > 0.0 else factor
            x[j, i], y[j, i] = scale * a, scale * b


@loop
def examine(bound, hit, x, y, u_x, u_y, e_x, e_y, kappa, free, turn):
    """Divide the points in contact into points that stick, which are marked in `free`, and points that slip.

    A point slips if its slip `w = e - u` is not opposite to its traction t, and if t was shortened to its bound (`hit`)
    or `t + kappa w` exceeds its bound. The map `turn` gets |w|/f for points that slip, with the part of w along t and
    the bound f.

    Return eight numbers, where P(t) is the traction t shortened to its bound: the sums of |t|, of `|P(t + kappa w)|`
    and of `|P(t + kappa w) - t|`; the sums of the magnitudes of the x and the y component of `P(t + kappa w) - t`; the
    sums of the x and the y component of w over the points that stick; and the number of points that stick.
    """
    size, moved, residual, along_x, along_y = 0.0, 0.0, 0.0, 0.0, 0.0
    w_sticks_x, w_sticks_y, count = 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            most = bound[j, i]
            if most <= 0.0:
                free[j, i] = False
                continue
            a, b = x[j, i], y[j, i]
            w_x, w_y = e_x[j, i] - u_x[j, i], e_y[j, i] - u_y[j, i]
            here, work = math.hypot(a, b), w_x * a + w_y * b
            other_x, other_y = a + kappa * w_x, b + kappa * w_y
            other = math.hypot(other_x, other_y)
            sticks = work <= 0.0 or not (hit[j, i] or other > most)
            free[j, i] = sticks
            turn[j, i] = 0.0 if sticks else work / (here * most)
            if other > most:
                other_x, other_y, other = other_x * (most / other), other_y * (most / other), most
            sums[0] += here
            sums[1] += other
            sums[2] += math.hypot(other_x - a, other_y - b)
            sums[3] += abs(other_x - a)
            sums[4] += abs(other_y - b)
            if sticks:
                sums[5] += w_x
                sums[6] += w_y
                sums[7] += 1.0
        size, moved, residual = size + sums[0], moved + sums[1], residual + sums[2]
        along_x, along_y = along_x + sums[3], along_y + sums[4]
        w_sticks_x, w_sticks_y, count = w_sticks_x + sums[5], w_sticks_y + sums[6], count + sums[7]
    return size, moved, residual, along_x, along_y, w_sticks_x, w_sticks_y, count


@loop
def residual(bound, free, turn, x, y, u_x, u_y, e_x, e_y, short, along_x, moves, r):
    """Put one component of the residual into the map r: the component along x if `along_x`, else along y.

    The residual of a point that sticks is its slip w. The residual of a point that slips is the part of w across its
    traction, times the root of `short/(short + turn)`. Points that can move along this axis are marked in `moves`:
    points that stick, and slipping points whose traction is sufficiently across the axis. Elsewhere r is 0.
    """
    for j in range(bound.shape[0]):
        for i in range(bound.shape[1]):
            a, b = x[j, i], y[j, i]
            turns = abs(b) > ACROSS * abs(a) if along_x else abs(a) > ACROSS * abs(b)
            moves[j, i] = free[j, i] or (bound[j, i] > 0.0 and turns)
            r[j, i] = 0.0
            if moves[j, i]:
                w_x, w_y = e_x[j, i] - u_x[j, i], e_y[j, i] - u_y[j, i]
                if not free[j, i]:
                    across = (a * w_y - b * w_x) / (a * a + b * b) * math.sqrt(short / (short + turn[j, i]))
                    w_x, w_y = -b * across, a * across
                r[j, i] = w_x if along_x else w_y


@loop
def complete(
    bound, free, turn, x, y, u_x, u_y, e_x, e_y, old_x, old_y, old_u_x, old_u_y, short, long, mean_x, mean_y, z_x, z_y
):
    """Complete the direction z from the preconditioned residual, which is in the maps (z_x, z_y).

    (mean_x, mean_y) is added to z at points that stick. At points that slip the part of z across the traction is
    multiplied by the root of `share = short/(short + turn)`, and `(1 - share)/(long + turn)` times the slip across the
    traction is added to it.

    Return the sums of r z, r d, z c and d c, with the residual r (the slip), the last change d of the tractions, and
    `c = A d + turn d`. At points that slip only the parts of r, d and c across the traction count.
    """
    r_z, r_d, z_c, d_c = 0.0, 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            if bound[j, i] <= 0.0:
                z_x[j, i], z_y[j, i] = 0.0, 0.0
                continue
            a, b = x[j, i], y[j, i]
            w_x, w_y = e_x[j, i] - u_x[j, i], e_y[j, i] - u_y[j, i]
            d_x, d_y = a - old_x[j, i], b - old_y[j, i]
            c_x, c_y = u_x[j, i] - old_u_x[j, i], u_y[j, i] - old_u_y[j, i]
            if not free[j, i]:
                here = math.hypot(a, b)
                a, b = -b / here, a / here
                w, d, c = a * w_x + b * w_y, a * d_x + b * d_y, a * c_x + b * c_y + turn[j, i] * (a * d_x + b * d_y)
                z = a * z_x[j, i] if abs(a) > ACROSS * abs(b) else 0.0
                z += b * z_y[j, i] if abs(b) > ACROSS * abs(a) else 0.0
                share = short / (short + turn[j, i])
                z = z * math.sqrt(share) + w * (1.0 - share) / (long + turn[j, i])
                z_x[j, i], z_y[j, i] = a * z, b * z
                w_x, w_y, d_x, d_y, c_x, c_y = a * w, b * w, a * d, b * d, a * c, b * c
            else:
                z_x[j, i] += mean_x
                z_y[j, i] += mean_y
            sums[0] += w_x * z_x[j, i] + w_y * z_y[j, i]
            sums[1] += w_x * d_x + w_y * d_y
            sums[2] += z_x[j, i] * c_x + z_y[j, i] * c_y
            sums[3] += d_x * c_x + d_y * c_y
        r_z, r_d, z_c, d_c = r_z + sums[0], r_d + sums[1], z_c + sums[2], d_c + sums[3]
    return r_z, r_d, z_c, d_c


@loop
def move_tractions(bound, free, x, y, z_x, z_y, step, again, new_x, new_y, hit):
    """Put the next tractions into the maps (new_x, new_y), which at first contain the previous tractions. (x, y) are
    the present tractions.

    The next tractions are (x, y) plus `step` times z plus `again` times the last change, from the previous to the
    present tractions. Then the tractions of points that slip get the length of their bounds, and other tractions that
    are longer than their bounds are shortened to these bounds. Return the sum of the magnitudes of all changes.
    """
    change = 0.0
    for j in range(bound.shape[0]):
        row_change = 0.0
        for i in range(bound.shape[1]):
            most = bound[j, i]
            if most <= 0.0:
                new_x[j, i], new_y[j, i], hit[j, i] = 0.0, 0.0, False
                continue
            a, b = x[j, i], y[j, i]
            d_x, d_y = a - new_x[j, i], b - new_y[j, i]
            if not free[j, i]:
                d = (a * d_y - b * d_x) / (a * a + b * b)
                d_x, d_y = -b * d, a * d
            a, b = a + step * z_x[j, i] + again * d_x, b + step * z_y[j, i] + again * d_y
            size = math.hypot(a, b)
            if size > most or not free[j, i]:
                a, b, size = a * (most / size), b * (most / size), most
            new_x[j, i], new_y[j, i], hit[j, i] = a, b, size >= AT_BOUND * most
            row_change += math.hypot(a - x[j, i], b - y[j, i])
        change += row_change
    return change


@loop
def change_since(bound, x, y, last_x, last_y, factor):
    """Return two sums over points in contact: by how much tractions have changed since the last step, and how large the
    last tractions were (magnitudes of vectors). The last tractions are `factor` times (last_x, last_y)."""
    change, size = 0.0, 0.0
    for j in range(bound.shape[0]):
        row_change, row_size = 0.0, 0.0
        for i in range(bound.shape[1]):
            a, b = factor * last_x[j, i], factor * last_y[j, i]
            row_size += math.hypot(a, b)
            if bound[j, i] > 0.0:
                row_change += math.hypot(x[j, i] - a, y[j, i] - b)
        change, size = change + row_change, size + row_size
    return change, size


@loop
def slope_and_curvature(t, new_t, u, new_u, e):
    """Return the sums of d w, d A d and |t w|, with the change `d = new_t - t` of the tractions and the slip `w = e -
    u`. u is A t, and `new_u` is A times the new tractions."""
    slope, curvature, size = 0.0, 0.0, 0.0
    for j in range(t.shape[0]):
        row_slope, row_curvature, row_size = 0.0, 0.0, 0.0
        for i in range(t.shape[1]):
            d, w = new_t[j, i] - t[j, i], e[j, i] - u[j, i]
            row_slope += d * w
            row_curvature += d * (new_u[j, i] - u[j, i])
            row_size += abs(t[j, i] * w)
        slope, curvature, size = slope + row_slope, curvature + row_curvature, size + row_size
    return slope, curvature, size


Vector = tuple[float, float]


def stacked(slab: Slab) -> Slab:
    """Return the slab of maps that stack two components: each rank has its rows of the first component, and then the
    same rows of the second component."""

    def twice(rank: int) -> slice:
        rows = slab.rows_of(rank)
        return slice(2 * rows.start, 2 * rows.stop)

    return Slab(slab.comm, slab.nx, 2 * slab.ny, slab.tally, twice)


def components(field: Array) -> tuple[Array, Array]:
    """Return views on the two components of a stacked map."""
    rows = len(field) // 2
    return field[:rows], field[rows:]


class ShearOperator:
    """Operator from tractions to displacements, both along the surface of a half space of shear modulus 1. Tractions
    lie in a box of this `size`, in any unit of length.

    The box is periodic unless it is `free`. `short` is the displacement of the shortest waves of the grid under a
    traction of 1 across their direction. The constructor and `apply` are collective.
    """

    def __init__(self, fft: FFT, size: Vector, poisson: float, free: bool) -> None:
        slab = fft.slab
        self.free, self.short = free, min(size[0] / slab.nx, size[1] / slab.ny) / np.pi
        self.fft = FFT(slab, padded_lengths(slab.nx, slab.ny), measured=fft.measured) if free else fft
        self._other = allocate(self.fft.shape, self.fft.complex, slab.tally)
        self._symbols = [allocate(self.fft.shape, np.float64, slab.tally) for _ in range(3)]
        if not slab.only_counts:
            self._fill(size, poisson, free)

    def _fill(self, size: Vector, poisson: float, free: bool) -> None:
        """Make the symbols of u_x over t_x, u_y over t_y and u_y over t_x."""
        if free:
            for symbol, coefficient in zip(self._symbols, _coefficients(poisson), strict=True):
                symbol[...] = tabulate(self.fft, size, coefficient).real
            return
        (qx, qy), (along_x, along_y) = wavenumbers(self.fft, size), travelling_wavenumbers(self.fft, size)
        q = np.hypot(qx, qy)
        q[q == 0.0] = np.inf
        for symbol, product in zip(self._symbols, (qx * qx, qy * qy, along_x * along_y), strict=True):
            symbol[...] = -poisson * product / q**3
        for symbol in self._symbols[:2]:
            symbol += 1.0 / q

    def apply(self, field: Array, out: Array) -> Array:
        """Put the displacements under the tractions `field` into `out`, both with stacked components; collective. A
        call counts as two operator calls."""
        self.fft.slab.tally["operator"] += 2
        (t_x, t_y), (u_x, u_y) = components(field), components(out)
        first: Spectrum = self._other
        first[...] = self.fft.forward(t_x)
        second = self.fft.forward(t_y)
        _mix(first, second, *self._symbols)
        self.fft.backward(second, u_y)
        self.fft.backward(first, u_x)
        return out


def _coefficients(poisson: float) -> tuple[Callable[..., Array], ...]:
    """Return three functions for the displacement at a distance (x, y) from a cell under a unit traction: along x by a
    traction along x, along y by one along y, and along y by one along x."""
    along = partial(_along, poisson=poisson)
    return along, lambda x, y, dx, dy: along(y, x, dy, dx), partial(_across, poisson=poisson)


def _along(x: Array, y: Array, dx: float, dy: float, poisson: float) -> Array:
    """Return the displacement along x of a unit traction along x on a cell."""
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    for i, j in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        a, b = x + 0.5 * i * dx, y + 0.5 * j * dy
        ratio = np.divide(a, np.abs(b), out=np.zeros(total.shape), where=b != 0.0)
        total += i * j * b * np.arcsinh(ratio)
    return love(x, y, dx, dy, poisson) + poisson / (2.0 * np.pi) * total


def _across(x: Array, y: Array, dx: float, dy: float, poisson: float) -> Array:
    """Return the displacement along y of a unit traction along x on a cell."""
    corners = ((i, j, np.hypot(x + 0.5 * i * dx, y + 0.5 * j * dy)) for i in (-1, 1) for j in (-1, 1))
    return np.asarray(sum(-i * j * r for i, j, r in corners) * (poisson / (2.0 * np.pi)))


@loop
def _mix(first, second, along_x, along_y, across):
    """Replace the spectra of tractions by the spectra of displacements."""
    for j in range(first.shape[0]):
        for i in range(first.shape[1]):
            x, y = first[j, i], second[j, i]
            first[j, i] = along_x[j, i] * x + across[j, i] * y
            second[j, i] = across[j, i] * x + along_y[j, i] * y


# tuning
STEP = 0.6  # least step along z; waves along q have half the stiffness that K assumes
FAR = 2.0  # ratio of the way to the least J and the way gone, or its inverse, from which the step changes
MOST_STIFFENING = 4.0  # limit on k over kappa
LEAST_PART = 0.2  # least share of a component in the residual for which K is applied to it
LEAST_DESCENT = 0.5  # least slope along a direction over that along z; below it the last change is forgotten
MOST_GROWTH = 20.0  # limit on gamma; reached where nothing resists, as all points of a periodic box stick
SMALL_SHARE = 0.2  # share of the way to the new tractions; below it, tractions follow the slip next
MAX_STALLED = 60  # limit on iterations without a smaller certificate
# accuracy
SHARE_OF_CHANGE = 0.2  # largest certificate over the change of tractions since the last step
LEAST_TOLERANCE = 0.1  # share of the tolerance that is small enough however little tractions change
LEAST_LEFT = 0.01  # share of the last tractions; errors of tractions that fall below it count relative to it
ROUNDING = 4 * float(np.finfo(np.float64).eps)  # share of sums of t w below which a change of J is rounding
Components = tuple[Array, Array, Array, Array, Array, Array]  # those of t, A t and e


class TractionProblem(NamedTuple):
    """Input of a solve. `bound` is the map of the bounds f. `aim` is the map of the displacements e at which points
    that stick end, with stacked components. `kappa` is a stiffness of the contact, in the unit of tractions divided by
    the unit of displacements. `tolerance` is the largest relative error with which a solve ends (the certificate of the
    module)."""

    bound: Array
    aim: Array
    kappa: float
    tolerance: float


@dataclass(frozen=True)
class Tractions:
    """Result of a solve. The map from which the solve started contains the tractions t. The map `displacement` has A t;
    it belongs to the solver and is valid until the next solve. `failure` is empty, or states why the tolerance was not
    reached."""

    displacement: Array
    certificate: float
    iterations: int
    failure: str = ""


class TangentialSolver:
    """Solver of tractions on one grid. `operator` takes both stacked components of tractions to displacements, and
    `preconditioner` takes one component of displacements to tractions. `limit` is the largest number of iterations."""

    def __init__(self, slab: Slab, operator: ShearOperator, preconditioner: Operator, grids: Grids, limit: int) -> None:
        self.slab, self._limit = slab, limit
        self._operator, self._preconditioner = operator, preconditioner
        self._extended = ExtendedPreconditioner(slab, larger=grids)
        both = stacked(slab)
        self._other, self._u, self._other_u, self._z = (both.zeros() for _ in range(4))
        self._turn = slab.zeros()
        self._free, self._hit, self._moves = (slab.zeros(np.bool_) for _ in range(3))

    def solve(self, problem: TractionProblem, t: Array, last: Array, factor: float = 1.0) -> Tractions:
        """Solve from the tractions in the map t, which the solution overwrites; collective. `factor` times `last` are
        the tractions of the step before."""
        bound, aim, kappa, asked = problem
        shorten_to_bounds(bound, *components(t), self._hit)
        if self._is_at_rest(bound, aim, t):
            self._u.fill(0.0)
            return Tractions(self._u, 0.0, 0)
        start, best, iteration, follows, step = t, (math.inf, 0), 0, False, STEP
        self._operator.apply(t, self._u)
        while True:
            now = *components(t), *components(self._u), *components(aim)
            found = self.slab.sum(*examine(bound, self._hit, *now, kappa, self._free, self._turn))
            change = self._move(bound, now, kappa, found, step, begins=iteration == 0)
            since = change_since(bound, *now[:2], *components(last), factor)
            change, changed, before = self.slab.sum(change, *since)
            size = max(*found[:2], LEAST_LEFT * before)
            certificate = max(found[2], change) / size
            tolerance = min(asked, max(SHARE_OF_CHANGE * changed / size, LEAST_TOLERANCE * asked))
            best = min(best, (certificate, iteration))
            failure = self._verdict(certificate, tolerance, iteration, best)
            if failure is not None:
                if t is not start:
                    start[...], self._other = t, t
                return Tractions(self._u, certificate, iteration, failure)
            if follows:
                self._other[...] = t + kappa * (aim - self._u)
                shorten_to_bounds(bound, *components(self._other), self._hit)
            t, share = self._descend(aim, t)
            if iteration > 0 and not follows and not 1.0 / FAR < share < FAR:
                step = min(max(share * step, STEP), MOST_GROWTH)
            follows, iteration = share < SMALL_SHARE, iteration + 1

    def _move(
        self, bound: Array, now: Components, kappa: float, found: list[float], step: float, begins: bool
    ) -> float:
        """Put the next tractions in the place of the last ones, and return this rank's sum of changes; collective.

        `now` are the components of t, A t and e, `found` the sums of `discs.examine`."""
        parts, mean = found[3:5], self._mean_step(kappa, *found[5:])
        z, points = components(self._z), (bound, self._free, self._turn)
        for along_x, r, part in zip((True, False), z, parts, strict=True):
            if part <= LEAST_PART * sum(parts):
                r.fill(0.0)
                continue
            residual(*points, *now, self._operator.short, along_x, self._moves, r)
            self._extended.apply(self._preconditioner, self._moves, r)
        last, last_u = components(self._other), components(self._other_u)
        products = complete(*points, *now, *last, *last_u, self._operator.short, 1.0 / kappa, *mean, *z)
        again = 0.0 if begins else _step_along_last(step, *self.slab.sum(*products))
        return move_tractions(bound, self._free, *now[:2], *z, step, again, *last, self._hit)

    def _mean_step(self, kappa: float, w_x: float, w_y: float, sticking: float) -> tuple[float, float]:
        """Return `k <w>`, from sums of the slip over points that stick; 0 if these fill the box, as nothing resists."""
        others = self.slab.points - sticking
        if self._operator.free or sticking == 0.0 or others == 0.0:
            return 0.0, 0.0
        k = kappa * min(self.slab.points / others, MOST_STIFFENING)
        return k * w_x / sticking, k * w_y / sticking

    def _descend(self, aim: Array, t: Array) -> tuple[Array, float]:
        """Go from the tractions t towards the next ones, to the least J on the way. Return the new tractions, and the
        way to the least J over the way to the next ones: at most 1 where tractions reach their bounds; collective."""
        new, u, new_u = self._other, self._u, self._other_u
        self._operator.apply(new, new_u)
        sums = slope_and_curvature(t, new, u, new_u, aim)
        slope, curvature, size, hits = self.slab.sum(*sums, float(self._hit.any()))
        rounded = max(abs(slope), curvature) <= ROUNDING * size
        share = 1.0 if rounded or curvature <= 0.0 or (hits and slope >= curvature) else max(slope / curvature, 0.0)
        if share < 1.0:
            for old, changed in ((t, new), (u, new_u)):
                changed -= old
                changed *= share
                changed += old
        self._other, self._u, self._other_u = t, new_u, u
        return new, share

    def _verdict(self, certificate: float, tolerance: float, iteration: int, best: tuple[float, int]) -> str | None:
        """Return None to continue, an empty string if solved, else why the solve has failed."""
        if certificate <= tolerance:
            return ""
        asked = f"{certificate:.3g} where {tolerance:.3g} was asked for"
        if iteration >= self._limit or not math.isfinite(certificate):
            failed = f"the tractions did not converge in {iteration} iterations: the residual is {asked}"
            return f"{failed}; try numerics.max_iterations above {self._limit}, or smaller steps"
        if iteration - best[1] >= MAX_STALLED:
            failed = f"the tractions stalled: no residual below {best[0]:.3g} in {MAX_STALLED} iterations, now {asked}"
            return f"{failed}; try a larger numerics.tolerance, or smaller steps"
        return None

    def _is_at_rest(self, bound: Array, aim: Array, t: Array) -> bool:
        """Return whether tractions and displacements are 0 at all points in contact; collective."""
        touching = bound > 0.0
        parts = *components(aim), *components(t)
        largest = max(float(np.abs(part).max(where=touching, initial=0.0)) for part in parts)
        return self.slab.reduce((), [largest])[0] == 0.0


def _step_along_last(step: float, r_z: float, r_d: float, z_c: float, d_c: float) -> float:
    """Return the step along the last change d for a step along z, from the products of `discs.complete`."""
    again = MOST_GROWTH
    if r_d <= MOST_GROWTH * d_c:
        again = (r_d - step * z_c) / d_c if d_c > 0.0 else 0.0
    return again if step * r_z + again * r_d > LEAST_DESCENT * step * r_z else 0.0


@loop
def settle_slips(bound, stiffness, alpha, t_x, t_y, alpha_old, old_x, old_y, u_x, u_y, target_x, target_y, slipping):
    """Find the points that stick after a step, and move the targets of all others.

    Let s be `target - u`, k the `stiffness`, and P the traction `t + k s` shortened to its bound. A point sticks if `t
    + k s` is shorter than its bound. Every other point slips by `s - r` with `r = (P - t)/k`, which is 0 for exact
    tractions, and its target becomes `u + r`. So an error of t is kept until a solve corrects this error. A point that
    slips loses the energy `(alpha t + alpha_old t_old)/2 (s - r)`, or 0 if this is negative.

    The map `slipping`, unless it is empty, gets `t (s - r)`, which is proportional to the power of slip at the end of
    the step. Return six sums: of the losses, of t along x, of t along y, and of the bounds; the number of points that
    stick; and the sum of `t (s - r)`.
    """
    writes = slipping.size > 0
    lost, total_x, total_y, most, stuck, power = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            a, b, limit = t_x[j, i], t_y[j, i], bound[j, i]
            s_x, s_y = target_x[j, i] - u_x[j, i], target_y[j, i] - u_y[j, i]
            sums[1] += a
            sums[2] += b
            sums[3] += limit
            if writes:
                slipping[j, i] = 0.0
            trial_x, trial_y = a + stiffness * s_x, b + stiffness * s_y
            size = math.hypot(trial_x, trial_y)
            if size < limit:
                sums[4] += 1.0
                continue
            r_x, r_y = 0.0, 0.0
            if limit > 0.0:
                r_x = (trial_x * (limit / size) - a) / stiffness
                r_y = (trial_y * (limit / size) - b) / stiffness
            s_x, s_y = s_x - r_x, s_y - r_y
            mean_x, mean_y = alpha * a + alpha_old * old_x[j, i], alpha * b + alpha_old * old_y[j, i]
            sums[0] += max(0.5 * (mean_x * s_x + mean_y * s_y), 0.0)
            if writes:
                slipping[j, i] = max(a * s_x + b * s_y, 0.0)
                sums[5] += slipping[j, i]
            target_x[j, i], target_y[j, i] = u_x[j, i] + r_x, u_y[j, i] + r_y
        lost, total_x, total_y = lost + sums[0], total_x + sums[1], total_y + sums[2]
        most, stuck, power = most + sums[3], stuck + sums[4], power + sums[5]
    return lost, total_x, total_y, most, stuck, power
