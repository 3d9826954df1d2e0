"""Laws of adhesion: attraction sigma of two surfaces as a function of their gap g, its energy gamma, and its slope.

A law has a `kind` (EXPONENTIAL or DUGDALE), a strength s, a range rho and a ramp r,

    exponential  sigma(g) = s exp(-g/rho),            gamma(g) = s rho exp(-g/rho),
    dugdale      sigma(g) = s ((rho - g)/r + 1/2), limited to 0..s, and -d gamma/dg = sigma.

Over the ramp, at most 2 rho, a constant attraction falls to 0: in a cell where the gap rises by r it is the mean of
the law without ramp, with the same energy gamma(0) = s rho. The exponential is the most expensive part of a loop, so
energy and slope are computed from sigma.

Laws of adhesion: the attraction of two surfaces as a function of their gap, and its length scales.

With the work of adhesion w [J/m^2], the range rho [m] and the gap g,

    exponential  sigma(g) = (w/rho) exp(-g/rho),          gamma(g) = w exp(-g/rho),
    dugdale      sigma(g) = w/rho for g < rho, else 0,    gamma(g) = w max(1 - g/rho, 0).

A node that crosses the end of Dugdale's law would snap, with an error proportional to the side h of the cells. So
the computed law ends over a ramp in the gap, centred at rho: it is the mean of the law over a cell at the end of the
process zone, where the gap rises by about 2 rho h/l in a cell.

The traction at the edge of a contact rises over the process zone `l = E* rho^2/w`, with E* = 2 G/(1 - nu). Tabor's
and Johnson's parameters classify adhesive contacts,

    mu = (R w^2/(E*^2 rho^3))^(1/3),        alpha^2 = 2 w lambda/(pi^2 E* h^2),

of a sphere of radius R (D. Tabor, J. Colloid Interface Sci. 58 (1977) 2), and of a wave of length lambda whose
crests are 2 h above its troughs (K. L. Johnson, Int. J. Solids Struct. 32 (1995) 423).

The fused loops run over the rows of this rank, and each returns partial sums for one Allreduce. In them the attraction
sigma follows a `Law`, and q is the pressure K (g + h), to which a mean is added.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from ...compiled import loop
from ...contact.constraint import Mask
from ...job.calculation import Grid
from ...parallel.slab import Array

EXPONENTIAL, DUGDALE = 0, 1
LOG_TWO = math.log(2.0)
TAYLOR = tuple(1.0 / math.factorial(power) for power in range(14))  # series of exp, exact to rounding up to LOG_TWO/2
FARTHEST = 700.0  # accuracy: largest exponent; exp(-x) of a larger x, below 1e-304, is taken as 0
POWERS = 2.0 ** -np.arange(FARTHEST / LOG_TWO + 2.0)


class Law(NamedTuple):
    """Law of attraction in the units of a solve. Only the kind DUGDALE has a ramp."""

    kind: int
    strength: float
    range: float
    ramp: float = 0.0

    @staticmethod
    def touches(gap: Array) -> Mask:
        """Return a map that is True where the gap is 0: surfaces touch there under pressure or tension."""
        return gap == 0.0


@loop
def decay(x):
    """Return `exp(-x)` for x >= 0, to a few units of rounding, in a form that compilers vectorize."""
    near = x if x < FARTHEST else FARTHEST
    whole = math.floor(near / LOG_TWO + 0.5)
    rest = whole * LOG_TWO - near
    result = TAYLOR[13]
    for power in range(12, -1, -1):
        result = result * rest + TAYLOR[power]
    return result * POWERS[int(whole)] if x < FARTHEST else 0.0


@loop
def attraction(law, g):
    """Return the attraction sigma of a law at the gap g."""
    if law.kind == EXPONENTIAL:
        return law.strength * decay(g / law.range)
    return law.strength * min(max((law.range - g) / law.ramp + 0.5, 0.0), 1.0)


@loop
def energy(law, g, sigma):
    """Return gamma(g), the energy per area needed to open the gap from g to infinity; sigma is the attraction at g."""
    if law.kind == EXPONENTIAL:
        return law.range * sigma
    end = law.range + 0.5 * law.ramp
    return sigma * (law.range - g if sigma == law.strength else 0.5 * (end - g))


@loop
def softening(law, sigma):
    """Return the slope `-d sigma/dg` of a law where the attraction is sigma."""
    if law.kind == EXPONENTIAL:
        return sigma / law.range
    return law.strength / law.ramp if 0.0 < sigma < law.strength else 0.0


KINDS = ("exponential", "dugdale")


@dataclass(frozen=True)
class AdhesionLaw:
    """Law of adhesion: work [J/m^2], range [m], kind, and the ramp [m] of Dugdale's law."""

    work: float
    range: float
    kind: Literal["exponential", "dugdale"] = "exponential"
    ramp: float = 0.0

    @property
    def strength(self) -> float:
        """Largest attraction [Pa]."""
        return self.work / self.range

    def process_zone(self, modulus: float) -> float:
        """Return the length l of the process zone [m] for the `modulus` E* [Pa]."""
        return modulus * self.range**2 / self.work

    def tabor(self, modulus: float, radius: float) -> float:
        """Return Tabor's parameter for the `modulus` E* [Pa] and the radius of a sphere [m]."""
        return (radius * self.work**2 / (modulus**2 * self.range**3)) ** (1.0 / 3.0)

    def johnson(self, modulus: float, length: float, amplitude: float) -> float:
        """Return Johnson's parameter for the `modulus` E* [Pa] and a wave of this length [m] and amplitude [m]."""
        return math.sqrt(2.0 * self.work * length / (math.pi**2 * modulus)) / abs(amplitude)


def ramp_of(law: AdhesionLaw, modulus: float, cell: float) -> float:
    """Return the ramp of Dugdale's law [m], 2 rho h/l and at most 2 rho, for E* [Pa] and the side h of a cell [m]."""
    return 2.0 * law.range * cell / max(law.process_zone(modulus), cell)


def smallest_range(work: float, modulus: float, cell: float, cells: float) -> float:
    """Return the range [m] whose process zone is as long as `cells` cells with the side `cell` [m], for E* [Pa]."""
    return math.sqrt(cells * cell * work / modulus)


def modulus_of(material: Any) -> float:
    """Return E* = 2 G/(1 - nu) of the relaxed body [Pa]."""
    return float(2.0 * material.fitted.long_modulus / (1.0 - material.poisson))


def cell_of(grid: Grid) -> float:
    """Return the longer side of a cell [m] among the directions with several points."""
    return max((step for step, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1), default=grid.dx)


SHORT = 1e-3  # accuracy: longest way over the range for which the trapezoidal energy is used; its error is 1e-7


@loop
def attract(law, g, sigma):
    """Put the attraction sigma(g) of a law into the map `sigma`."""
    for j in range(g.shape[0]):
        for i in range(g.shape[1]):
            sigma[j, i] = attraction(law, g[j, i])


@loop
def press(g, q, sigma, step, image):
    """Add `step image` to the pressure q. Return the number of open points and their sum of `q + sigma`."""
    count, total = 0.0, 0.0
    for j in range(g.shape[0]):
        row_count, row_total = 0.0, 0.0
        for i in range(g.shape[1]):
            q[j, i] += step * image[j, i]
            weight = 1.0 if g[j, i] > 0.0 else 0.0
            row_count += weight
            row_total += weight * (q[j, i] + sigma[j, i])
        count += row_count
        total += row_total
    return count, total


@loop
def pressure_residual(g, q, sigma, mean, working, c):
    """Put `q + mean + sigma` into c on the working set (open points, and closed points under tension), 0 elsewhere.
    Return the size of the set, the sum of c, the sum of sigma over all points, and the largest -g."""
    count, total, attracted = 0.0, 0.0, 0.0
    lowest, deepest = np.empty(g.shape[1]), -np.inf
    for i in range(lowest.size):
        lowest[i] = np.inf
    for j in range(g.shape[0]):
        row_count, row_total, row_attracted = 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            pushed = q[j, i] + mean + sigma[j, i]
            lowest[i] = min(lowest[i], g[j, i])
            row_attracted += sigma[j, i]
            inside = (g[j, i] > 0.0) | (pushed < 0.0)
            working[j, i] = inside
            c[j, i] = pushed if inside else 0.0
            row_count += 1.0 if inside else 0.0
            row_total += pushed if inside else 0.0
        count += row_count
        total += row_total
        attracted += row_attracted
    for i in range(lowest.size):
        deepest = max(deepest, -lowest[i])
    return count, total, attracted, deepest


@loop
def certificate_sums(working, g, h, q, mean, sigma, z):
    """Return the sums of `certify_gap`: over all points of w, w u and w u^2, over the working set of w |z|, |c| and c.

    Here `p = q + mean`, `c = p + sigma` on the working set and 0 elsewhere, `u = g + h`, and the weight `w = |p| +
    |c|`.
    """
    load, first, second, wrong, spurious, net = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(g.shape[0]):
        row_load, row_first, row_second, row_wrong, row_spurious, row_net = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            p, u, weight = q[j, i] + mean, g[j, i] + h[j, i], 1.0 if working[j, i] else 0.0
            c = weight * (p + sigma[j, i])
            size = abs(p) + abs(c)
            row_load += size
            row_first += size * u
            row_second += size * u * u
            row_wrong += weight * size * abs(z[j, i])
            row_spurious += abs(c)
            row_net += c
        load += row_load
        first += row_first
        second += row_second
        wrong += row_wrong
        spurious += row_spurious
        net += row_net
    return load, first, second, wrong, spurious, net


@loop
def gap_products(working, q, mean, sigma, step, image, sigma_old, shift, z, t):
    """Return the sums over the working set of z, t, c z, e z and c t, with `c = q + mean + sigma` and its change in the
    last step, `e = step image + sigma - sigma_old + shift`."""
    sum_z, sum_t, c_z, e_z, c_t = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(z.shape[0]):
        row_z, row_t, row_c_z, row_e_z, row_c_t = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(z.shape[1]):
            weight = 1.0 if working[j, i] else 0.0
            z_here, t_here = weight * z[j, i], weight * t[j, i]
            c = q[j, i] + mean + sigma[j, i]
            row_z += z_here
            row_t += t_here
            row_c_z += c * z_here
            row_e_z += (step * image[j, i] + sigma[j, i] - sigma_old[j, i] + shift) * z_here
            row_c_t += c * t_here
        sum_z += row_z
        sum_t += row_t
        c_z += row_c_z
        e_z += row_e_z
        c_t += row_c_t
    return sum_z, sum_t, c_z, e_z, c_t


@loop
def lead(g, t, step, way):
    """Put the change of the gap `max(g - step t, 0) - g` into `way`. Return the sum of the gaps after it, and by how
    much the limit 0 has raised this sum."""
    total, cut = 0.0, 0.0
    for j in range(t.shape[0]):
        row_total, row_cut = 0.0, 0.0
        for i in range(t.shape[1]):
            wanted = g[j, i] - step * t[j, i]
            kept = wanted if wanted > 0.0 else 0.0
            way[j, i] = kept - g[j, i]
            row_total += kept
            row_cut += kept - wanted
        total += row_total
        cut += row_cut
    return total, cut


@loop
def rescale(g, factor, way):
    """Change the gap after the step, to which `way` leads, by a `factor`: replace `way` accordingly."""
    for j in range(g.shape[0]):
        for i in range(g.shape[1]):
            way[j, i] = factor * (g[j, i] + way[j, i]) - g[j, i]


@loop
def curvature(law, g, q, mean, sigma, way, image):
    """Return the sums of `-c w`, `w K w`, `w^2 (-d sigma/dg)` and w, and the largest -w/g, for the change w of the gap
    (`way`) with the image K w (`image`)."""
    slope, stiff, soft, total = 0.0, 0.0, 0.0, 0.0
    fastest, most = np.empty(g.shape[1]), 0.0
    for i in range(fastest.size):
        fastest[i] = 0.0
    for j in range(g.shape[0]):
        row_slope, row_stiff, row_soft, row_total = 0.0, 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            w = way[j, i]
            row_slope -= (q[j, i] + mean + sigma[j, i]) * w
            row_stiff += w * image[j, i]
            row_soft += w * w * softening(law, sigma[j, i])
            row_total += w
            fastest[i] = max(fastest[i], -w / g[j, i] if w < 0.0 else 0.0)
        slope += row_slope
        stiff += row_stiff
        soft += row_soft
        total += row_total
    for i in range(fastest.size):
        most = max(most, fastest[i])
    return slope, stiff, soft, total, most


@loop
def move(law, g, q, mean, sigma, step, way, image, g_new, sigma_new):
    """Put `g + step way`, at least 0, into `g_new`, and the attraction there into `sigma_new`. Return the change of
    energy, the sum of `d (q + mean + step image/2) + gamma(g) - gamma(g_new)` with `d = g_new - g`, and the sum of the
    terms' magnitudes. For short ways the change of gamma is d times the mean attraction, which rounds less."""
    total, size = 0.0, 0.0
    for j in range(g.shape[0]):
        row_total, row_size = 0.0, 0.0
        for i in range(g.shape[1]):
            now, d, pull = g[j, i], step * way[j, i], sigma[j, i]
            new = now + d if now + d > 0.0 else 0.0
            pull_new = attraction(law, new)
            surface = energy(law, now, pull) - energy(law, new, pull_new)
            if law.kind == EXPONENTIAL and abs(d) < SHORT * law.range:
                surface = 0.5 * d * (pull + pull_new)
            push = q[j, i] + mean + 0.5 * step * image[j, i]
            g_new[j, i] = new
            sigma_new[j, i] = pull_new
            row_total += d * push + surface
            row_size += abs(d * push) + abs(surface)
        total += row_total
        size += row_size
    return total, size


@loop
def weighted_sums(p, a):
    """Return the sums of |p| and of |p| a."""
    load, total = 0.0, 0.0
    for j in range(p.shape[0]):
        row_load, row_total = 0.0, 0.0
        for i in range(p.shape[1]):
            row_load += abs(p[j, i])
            row_total += abs(p[j, i]) * a[j, i]
        load += row_load
        total += row_total
    return load, total


@loop
def weigh_off(p, a, level):
    """Return the sum of |p (a - level)| over the map a, weighted by p."""
    total = 0.0
    for j in range(p.shape[0]):
        row = 0.0
        for i in range(p.shape[1]):
            row += abs(p[j, i] * (a[j, i] - level))
        total += row
    return total


@loop
def surface_energy(law, g):
    """Return the sum of `-gamma(g)`, the energy of the surfaces."""
    total = 0.0
    for j in range(g.shape[0]):
        row = 0.0
        for i in range(g.shape[1]):
            row -= energy(law, g[j, i], attraction(law, g[j, i]))
        total += row
    return total


@loop
def tension(p, least):
    """Return the number of points with a tension above `least`, and the sum of all tensions."""
    count, total = 0.0, 0.0
    for j in range(p.shape[0]):
        row_count, row_total = 0.0, 0.0
        for i in range(p.shape[1]):
            row_count += 1.0 if p[j, i] < -least else 0.0
            row_total += max(-p[j, i], 0.0)
        count += row_count
        total += row_total
    return count, total
