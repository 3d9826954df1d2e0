"""Warnings about magnitudes of adhesion: work and range beside those of solids, the body, the surface, mesh and box.

A sphere attracts a flat body at the gap d with `2 pi R gamma(d)`. Of that `gamma(d + r^2/(2 R))/gamma(d)` comes from
further than r from its axis. Summed over the points of a mesh with cells h the force of the exponential law is wrong by
up to `4 exp(-2 pi^2 R rho/h^2)`, by Poisson's sum of a Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ..job.checks import meaning
from ..job.sections.calculation import Grid
from ..job.sections.geometry import Sphere
from ..physics.adhesion import AdhesionLaw
from ..printed import per_cent

MOST_WORK = 1.0  # physics: surfaces of dry solids have less [J/m^2]; of rubber 0.03 to 0.1
MOST_STRAIN = 0.5  # physics: as for slopes: the theory is linear
MOST_RANGE = 0.2  # physics: of the box: the law is that of flat surfaces, as near as their curvature is small
MOST_RING = 2.0  # accuracy: the force of an undeformed sphere is then wrong by 4 exp(-2 pi^2/4) = 3 %
SMALL = 0.01  # accuracy: of a force; what is less passes
PULL_OFF = 1.5 * math.pi  # physics: over w R, of a short range, elastic; others are larger


def sizes(job: Any, law: AdhesionLaw, modulus: float, cell: float) -> Iterator[str]:
    """Yield what to say of a work or a range whose magnitude cannot be meant, or that the model is not made for, with
    E* of the relaxed body [Pa] and the side of a cell [m]."""
    told = f"adhesion.work is {law.work:g} J/m^2 and the range {law.range:.3g} m"
    if law.work > MOST_WORK:
        yield (
            f"adhesion: {told}: to part dry surfaces takes {MOST_WORK:g} J/m^2 at most, of rubber some 0.05; what a "
            "body dissipates comes beside it, from its material"
        )
    elif modulus and (strain := law.strength / modulus) > MOST_STRAIN:
        yield (
            f"adhesion: strains at the edges of contact are some work/(E* range) = {strain:.2g}, and the theory is for "
            f"small ones, at most {MOST_STRAIN:g}: {told}; use a longer range, or less work"
        )
    sides = [size for size, n in zip(job.grid.size, job.grid.points, strict=True) if n > 1] or list(job.grid.size)
    if law.range > MOST_RANGE * min(sides):
        yield (
            f"adhesion: {told}, more than {MOST_RANGE:g} of the box: points then attract more than what lies opposite, "
            "which the law does not know; use a shorter range"
        )
    for index, shape in enumerate(job.surface):
        if isinstance(shape, Sphere):
            yield from _sphere(f"surface.{index}", shape, job.grid, law, cell)
    if modulus > 0.0 and not list(meaning.neighbours(job, job.material.fitted)):
        contact = (0.75 * PULL_OFF * law.work / modulus) ** (1.0 / 3.0)  # of Hertz under the pull-off, over R^(2/3)
        yield from meaning.acting_neighbours(job, lambda radius: contact * radius ** (2.0 / 3.0))


def _sphere(name: str, sphere: Sphere, grid: Grid, law: AdhesionLaw, cell: float) -> Iterator[str]:
    """Yield what to say of a sphere, of whose attraction the cells or the box see little, or which is too small."""
    radius, ring = sphere.radius, math.sqrt(sphere.radius * law.range)
    if cell > MOST_RING * ring:
        yield (
            f"adhesion: a cell, {cell:.3g} m, is {cell / ring:.2g} times sqrt(radius range), how far {name} is "
            f"attracted around its tip: {MOST_RING:g} times makes the sum over points wrong by 3 %, more is worse; use "
            f"cells of {MOST_RING * ring:.3g} m, or a range of {cell**2 / MOST_RING**2 / radius:.3g} m"
        )
    if law.range > radius / 2.0:
        yield (
            f"{name}: it attracts out to sqrt(2 radius range), more than its radius, {radius:g} m, and the theory is "
            f"one of small slopes; use an adhesion.range up to {radius / 2.0:.3g} m"
        )
    if min(grid.points) == 1:
        return
    x, y = sphere.center or (grid.lx / 2.0, grid.ly / 2.0)
    alone = grid.boundary == "free"
    room = max(min(x, grid.lx - x, y, grid.ly - y), 0.0) if alone else min(grid.size) / 2.0
    edge, exponential = room**2 / (2.0 * radius) / law.range, law.kind == "exponential"
    share = math.exp(-edge) if exponential else max(1.0 - edge, 0.0)
    if share > SMALL:
        enough = -math.log(SMALL) if exponential else 1.0
        shorter = f"a range up to {law.range * edge / enough:.3g} m, or " if edge else ""
        yield (
            f"{name}: {per_cent(share)} of its attraction over an adhesion.range of {law.range:.3g} m comes from "
            f"beyond {room:.3g} m, where the box ends; {per_cent(SMALL)} passes: use {shorter}"
            f"{math.sqrt(2.0 * enough) * ring:.3g} m of room around the sphere"
        )


def beyond_heights(law: AdhesionLaw, span: float) -> str:
    """Return what to say of a range above the heights of a rough surface, from its lowest to its highest point [m], or
    ''; a flat one has none."""
    if law.range <= span or not span:
        return ""
    return (
        f"adhesion: the range, {law.range:.3g} m, is more than the {span:.3g} m from the lowest to the highest point "
        "of the surface, which then attracts nearly alike everywhere: adhesion is hardly more than a pressure of "
        "work/range; use a shorter range (range: auto follows the cells)"
    )
