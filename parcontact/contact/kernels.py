"""Fused loops over the rows of this rank: each reads every map once and returns partial sums for one Allreduce.

Sums are taken in double precision, first along rows and then over rows: their rounding error grows with the sum of
both numbers of points, not with the product."""

from ..compiled import loop


@loop
def pressure_sums(p, u, h, d):
    """Return the sums of p, p u, p g and p u^2, with `g = u - h - d`."""
    load, work, squares, gaps = 0.0, 0.0, 0.0, 0.0
    for j in range(p.shape[0]):
        row_load, row_work, row_squares, row_gaps = 0.0, 0.0, 0.0, 0.0
        for i in range(p.shape[1]):
            pressed = p[j, i] * u[j, i]
            row_load += p[j, i]
            row_work += pressed
            row_squares += pressed * u[j, i]
            row_gaps += p[j, i] * (u[j, i] - h[j, i] - d)
        load += row_load
        work += row_work
        squares += row_squares
        gaps += row_gaps
    return load, work, gaps, squares


@loop
def gap_residual(working, u, h, d, r):
    """Put `u - h - d` on the working set and 0 elsewhere into r."""
    for j in range(r.shape[0]):
        for i in range(r.shape[1]):
            r[j, i] = u[j, i] - h[j, i] - d if working[j, i] else 0.0


@loop
def step_products(working, u, h, d, u_old, z, t):
    """Return sums over the working set of z, t, c, r z, c z and r t, with `r = u - h - d` in the precision of z and `c
    = u - u_old`."""
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
    """Put `z + beta t - mean` on the working set and 0 elsewhere into t."""
    for j in range(t.shape[0]):
        for i in range(t.shape[1]):
            t[j, i] = z[j, i] + beta * t[j, i] - mean if working[j, i] else 0.0


@loop
def sum_of(a):
    """Return the sum of a."""
    result = 0.0
    for j in range(a.shape[0]):
        row = 0.0
        for i in range(a.shape[1]):
            row += a[j, i]
        result += row
    return result
