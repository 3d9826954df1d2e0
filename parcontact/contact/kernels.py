"""Loops over the rows of this rank. Each loop reads every map once and returns partial sums for one Allreduce.

Sums are taken in double precision, first along rows and then over rows, so that their rounding errors grow with nx + ny
and not with nx ny.
"""

import numpy as np

from ..compiled import loop


@loop
def contact_sums(p, u, h, d, lowest, highest):
    """Return the sums of p, p u, p g and p u^2 over all points, with `g = u - h - d`, then the sums of `p - lowest` and
    `(p - lowest) g` over points with p below `highest`."""
    load, work, gaps, squares, free_load, free_gaps = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(p.shape[0]):
        row_load, row_work, row_gaps, row_squares, row_free_load, row_free_gaps = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(p.shape[1]):
            pressed, gap = p[j, i] * u[j, i], u[j, i] - h[j, i] - d
            free = p[j, i] - lowest if p[j, i] < highest else 0.0
            row_load += p[j, i]
            row_work += pressed
            row_gaps += p[j, i] * gap
            row_squares += pressed * u[j, i]
            row_free_load += free
            row_free_gaps += free * gap
        load += row_load
        work += row_work
        gaps += row_gaps
        squares += row_squares
        free_load += row_free_load
        free_gaps += row_free_gaps
    return load, work, gaps, squares, free_load, free_gaps


@loop
def mark_working_set(p, u, h, d, lowest, highest, working):
    """Set `working` to True at points with p above `lowest` and at points that penetrate (g < 0), with `g = u - h - d`,
    and to False elsewhere. Points at `highest` with g <= 0 are held: they do not belong to the working set. Return five
    numbers:

    * the sum of `(p - lowest) |g|` over all points that are not held;
    * the number of points in the working set;
    * the sum of g over the working set;
    * the number of held points;
    * the largest -g of points below `highest`.
    """
    wrong, count, gaps, held = 0.0, 0.0, 0.0, 0.0
    least, deepest = np.empty(p.shape[1]), -np.inf
    for i in range(least.size):
        least[i] = np.inf
    for j in range(p.shape[0]):
        row_wrong, row_count, row_gaps, row_held = 0.0, 0.0, 0.0, 0.0
        for i in range(p.shape[1]):
            gap = u[j, i] - h[j, i] - d
            yields = p[j, i] >= highest
            stays = yields & (gap <= 0.0)
            inside = ((p[j, i] > lowest) | (gap < 0.0)) & ~stays
            working[j, i] = inside
            weight = 1.0 if inside else 0.0
            row_wrong += 0.0 if stays else (p[j, i] - lowest) * abs(gap)
            row_count += weight
            row_gaps += weight * gap
            row_held += 1.0 if stays else 0.0
            least[i] = min(least[i], np.inf if yields else gap)
        wrong += row_wrong
        count += row_count
        gaps += row_gaps
        held += row_held
    for i in range(least.size):
        deepest = max(deepest, -least[i])
    return wrong, count, gaps, held, deepest


@loop
def advance(p_old, t, step, lowest, highest, p):
    """Put `p_old - step t`, limited to the bounds, into p. Return the sum of p, and the sum of the magnitudes by which
    these limits have changed p."""
    load, cut = 0.0, 0.0
    for j in range(p.shape[0]):
        row_load, row_cut = 0.0, 0.0
        for i in range(p.shape[1]):
            value = p_old[j, i] - step * t[j, i]
            kept = lowest if value < lowest else value
            kept = highest if kept > highest else kept
            p[j, i] = kept
            row_load += kept
            row_cut += abs(kept - value)
        load += row_load
        cut += row_cut
    return load, cut


@loop
def gap_residual(working, u, h, d, r):
    """Set r to the gap `u - h - d` on the working set and to 0 elsewhere."""
    for j in range(r.shape[0]):
        for i in range(r.shape[1]):
            r[j, i] = u[j, i] - h[j, i] - d if working[j, i] else 0.0


@loop
def step_products(working, u, h, d, u_old, z, t):
    """Return the sums over the working set of z, t, c, r z, c z and r t. Here z is the preconditioned residual, t the
    direction, `c = u - u_old` the last change of the displacement, and `r = u - h - d`, rounded to the precision of z.
    """
    sum_z, sum_t, sum_change, r_z, change_z, r_t = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(z.shape[0]):
        row_z, row_t, row_change, row_r_z, row_change_z, row_r_t = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(z.shape[1]):
            weight = 1.0 if working[j, i] else 0.0
            r = z.dtype.type(u[j, i] - h[j, i] - d)
            z_here, t_here, change_here = weight * z[j, i], weight * t[j, i], weight * (u[j, i] - u_old[j, i])
            row_z += z_here
            row_t += t_here
            row_change += change_here
            row_r_z += r * z_here
            row_change_z += change_here * z_here
            row_r_t += r * t_here
        sum_z += row_z
        sum_t += row_t
        sum_change += row_change
        r_z += row_r_z
        change_z += row_change_z
        r_t += row_r_t
    return sum_z, sum_t, sum_change, r_z, change_z, r_t


@loop
def turn(working, z, beta, mean, t):
    """Replace the direction t by `z + beta t - mean` on the working set and by 0 elsewhere."""
    for j in range(t.shape[0]):
        for i in range(t.shape[1]):
            t[j, i] = z[j, i] + beta * t[j, i] - mean if working[j, i] else 0.0


@loop
def sum_of(a):
    """Return the sum of a over the rows of this rank, in double precision."""
    result = 0.0
    for j in range(a.shape[0]):
        row = 0.0
        for i in range(a.shape[1]):
            row += a[j, i]
        result += row
    return result
