"""Fused loops for contact with adhesion, over the rows of this rank; each returns partial sums for one Allreduce.

The attraction sigma follows a `Law`; q is the pressure K (g + h), to which a mean is added.
"""

import numpy as np

from ...compiled import loop
from .law import EXPONENTIAL, attraction, energy, softening

SHORT = 1e-3  # accuracy: longest way over the range for which the trapezoidal energy is used; its error is 1e-7


@loop
def attract(law, g, sigma):
    """Put sigma(g) into `sigma`."""
    for j in range(g.shape[0]):
        for i in range(g.shape[1]):
            sigma[j, i] = attraction(law, g[j, i])


@loop
def press(g, q, sigma, step, image):
    """Add `step image` to q. Return the number of open points and their sum of `q + sigma`."""
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
    """Mark the working set (open points, and closed points under tension) and put `q + mean + sigma` there, 0
    elsewhere, into c. Return the size of the set, the sum of c, the sum of sigma over all points, and the largest
    -g."""
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
    """Return the sums for `certify_gap`: of w, w u, w u^2 over all points, of w |z| over the working set, of |c| and of
    c.

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
    """Return sums over the working set of z, t, c z, e z and c t, with `c = q + mean + sigma` and its change in the
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
    """Put the way `max(g - step t, 0) - g` of a step into `way`. Return the sum of the gaps at its end, and how much
    limiting has raised it."""
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
    """Change the way so that it leads to `factor` times the gap at its end."""
    for j in range(g.shape[0]):
        for i in range(g.shape[1]):
            way[j, i] = factor * (g[j, i] + way[j, i]) - g[j, i]


@loop
def curvature(law, g, q, mean, sigma, way, image):
    """Return sums over a way w of `-c w`, of `w K w` (K w is `image`), of `w^2 (-d sigma/dg)` and of w; and the largest
    -w/g."""
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
    """Put `g + step way`, limited to 0, into `g_new`, and its attraction into `sigma_new`. Return the change of energy,
    the sum of `d (q + mean + step image/2) + gamma(g) - gamma(g_new)` with `d = g_new - g`, and the sum of the
    magnitudes of its terms. For short ways the change of gamma is d times the mean attraction, which rounds less."""
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
    """Return the sum of |p (a - level)|."""
    total = 0.0
    for j in range(p.shape[0]):
        row = 0.0
        for i in range(p.shape[1]):
            row += abs(p[j, i] * (a[j, i] - level))
        total += row
    return total


@loop
def surface_energy(law, g):
    """Return the sum of `-gamma(g)`."""
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
