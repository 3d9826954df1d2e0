"""Fused loops over this rank's rows for contacts that stick; each returns partial sums for one Allreduce.

A law is three numbers: its `kind` (EXPONENTIAL or DUGDALE), its strength `s` and its range `rho`,

    exponential  sigma(g) = s exp(-g/rho),           gamma(g) = s rho exp(-g/rho),
    dugdale      sigma(g) = s where g < rho, else 0,  gamma(g) = s max(rho - g, 0).
"""

import math

import numpy as np

from ...compiled import loop

EXPONENTIAL, DUGDALE = 0, 1


@loop
def traction(kind, s, rho, g):
    """The attraction sigma at a gap."""
    if kind == EXPONENTIAL:
        return s * math.exp(-g / rho)
    return s if g < rho else 0.0


@loop
def energy(kind, s, rho, g):
    """The energy gamma per area that it takes to open a gap from g on."""
    if kind == EXPONENTIAL:
        return s * rho * math.exp(-g / rho)
    return s * (rho - g) if g < rho else 0.0


@loop
def softening(kind, s, rho, g):
    """`-d sigma/dg`."""
    if kind == EXPONENTIAL:
        return s / rho * math.exp(-g / rho)
    return 0.0


@loop
def open_residual(kind, s, rho, g, q):
    """Over points with an open gap: their count, and the sum of `q + sigma(g)`."""
    count, total = 0.0, 0.0
    for j in range(g.shape[0]):
        row_count, row_total = 0.0, 0.0
        for i in range(g.shape[1]):
            if g[j, i] > 0.0:
                row_count += 1.0
                row_total += q[j, i] + traction(kind, s, rho, g[j, i])
        count += row_count
        total += row_total
    return count, total


@loop
def residual(kind, s, rho, g, q, mean, working, c, c_old):
    """`c = q + mean + sigma(g)` on the working set, open points and those in contact that are pulled, else 0; the old
    one is kept. Returns the size of the set, the sums of c over it and of sigma over all points, and the largest -g."""
    count, total, attraction = 0.0, 0.0, 0.0
    lowest = np.full(g.shape[1], np.inf)
    for j in range(g.shape[0]):
        row_count, row_total, row_attraction = 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            c_old[j, i] = c[j, i]
            pull = traction(kind, s, rho, g[j, i])
            pushed = q[j, i] + mean + pull
            lowest[i] = min(lowest[i], g[j, i])
            row_attraction += pull
            inside = (g[j, i] > 0.0) | (pushed < 0.0)
            working[j, i] = inside
            c[j, i] = pushed if inside else 0.0
            row_count += 1.0 if inside else 0.0
            row_total += pushed if inside else 0.0
        count += row_count
        total += row_total
        attraction += row_attraction
    return count, total, attraction, -lowest.min()


@loop
def centre(working, mean, c):
    """`c <- c - mean` on the working set."""
    for j in range(c.shape[0]):
        for i in range(c.shape[1]):
            c[j, i] = c[j, i] - mean if working[j, i] else 0.0


@loop
def judge(working, q, mean, c, g, h, z):
    """Sums of the weights `|p| + |c|`, of these times u and u^2, and over the working set times |z|, with
    `p = q + mean` and `u = g + h`."""
    load, first, second, wrong = 0.0, 0.0, 0.0, 0.0
    for j in range(g.shape[0]):
        row_load, row_first, row_second, row_wrong = 0.0, 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            size, u = abs(q[j, i] + mean) + abs(c[j, i]), g[j, i] + h[j, i]
            row_load += size
            row_first += size * u
            row_second += size * u * u
            row_wrong += size * abs(z[j, i]) if working[j, i] else 0.0
        load += row_load
        first += row_first
        second += row_second
        wrong += row_wrong
    return load, first, second, wrong


@loop
def products(working, c, c_old, z, t):
    """Over the working set: sums of z, t, c z, c_old z and c t."""
    sum_z, sum_t, c_z, old_z, c_t = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(c.shape[0]):
        row_z, row_t, row_c_z, row_old_z, row_c_t = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(c.shape[1]):
            weight = 1.0 if working[j, i] else 0.0
            z_here, t_here = weight * z[j, i], weight * t[j, i]
            row_z += z_here
            row_t += t_here
            row_c_z += c[j, i] * z_here
            row_old_z += c_old[j, i] * z_here
            row_c_t += c[j, i] * t_here
        sum_z += row_z
        sum_t += row_t
        c_z += row_c_z
        old_z += row_old_z
        c_t += row_c_t
    return sum_z, sum_t, c_z, old_z, c_t


@loop
def turn(working, z, beta, mean, t):
    """`t <- z + beta t - mean` on the working set, 0 elsewhere."""
    for j in range(t.shape[0]):
        for i in range(t.shape[1]):
            t[j, i] = z[j, i] + beta * t[j, i] - mean if working[j, i] else 0.0


@loop
def curvature(kind, s, rho, g, t, image):
    """Sums of `t K t`, whose second factor is the image, of `t^2 (-d sigma/dg)`, and of t."""
    stiff, soft, total = 0.0, 0.0, 0.0
    for j in range(t.shape[0]):
        row_stiff, row_soft, row_total = 0.0, 0.0, 0.0
        for i in range(t.shape[1]):
            row_stiff += t[j, i] * image[j, i]
            row_soft += t[j, i] * t[j, i] * softening(kind, s, rho, g[j, i])
            row_total += t[j, i]
        stiff += row_stiff
        soft += row_soft
        total += row_total
    return stiff, soft, total


@loop
def advance(g, t, step, out):
    """`out = max(g - step t, 0)`; its sum, and by how much cutting off has raised it."""
    total, cut = 0.0, 0.0
    for j in range(g.shape[0]):
        row_total, row_cut = 0.0, 0.0
        for i in range(g.shape[1]):
            value = g[j, i] - step * t[j, i]
            kept = 0.0 if value < 0.0 else value
            out[j, i] = kept
            row_total += kept
            row_cut += kept - value
        total += row_total
        cut += row_cut
    return total, cut


@loop
def change(kind, s, rho, g, q, g_new, q_new):
    """Sums of `(g_new - g) (q + q_new)/2 - gamma(g_new) + gamma(g)`, its magnitude, and of `g_new - g`."""
    total, size, moved = 0.0, 0.0, 0.0
    for j in range(g.shape[0]):
        row_total, row_size, row_moved = 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            rise = g_new[j, i] - g[j, i]
            elastic = 0.5 * rise * (q[j, i] + q_new[j, i])
            surface = energy(kind, s, rho, g[j, i]) - energy(kind, s, rho, g_new[j, i])
            row_total += elastic + surface
            row_size += abs(elastic) + abs(surface)
            row_moved += rise
        total += row_total
        size += row_size
        moved += row_moved
    return total, size, moved


@loop
def subtract(q, step, image, out):
    """`out = q - step image`."""
    for j in range(q.shape[0]):
        for i in range(q.shape[1]):
            out[j, i] = q[j, i] - step * image[j, i]


@loop
def weigh(p, a):
    """Sums of |p| and of |p| a."""
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
    """Sum of |p (a - level)|."""
    total = 0.0
    for j in range(p.shape[0]):
        row = 0.0
        for i in range(p.shape[1]):
            row += abs(p[j, i] * (a[j, i] - level))
        total += row
    return total


@loop
def count_flips(g_old, g):
    """The number of points that are in contact in one of two maps of gaps, and not in the other."""
    count = 0.0
    for j in range(g.shape[0]):
        row = 0.0
        for i in range(g.shape[1]):
            row += 1.0 if (g_old[j, i] == 0.0) != (g[j, i] == 0.0) else 0.0
        count += row
    return count


@loop
def surface_energy(kind, s, rho, g):
    """Sum of `-gamma(g)`."""
    total = 0.0
    for j in range(g.shape[0]):
        row = 0.0
        for i in range(g.shape[1]):
            row -= energy(kind, s, rho, g[j, i])
        total += row
    return total


@loop
def tension(p, least):
    """The number of points with more tension than that, and the sum of all tension."""
    count, total = 0.0, 0.0
    for j in range(p.shape[0]):
        row_count, row_total = 0.0, 0.0
        for i in range(p.shape[1]):
            row_count += 1.0 if p[j, i] < -least else 0.0
            row_total += max(-p[j, i], 0.0)
        count += row_count
        total += row_total
    return count, total
