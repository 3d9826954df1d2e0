"""Part `layers`: operator calls of layers of many thicknesses over those of the half space, at equal contact area."""

import argparse
from collections.abc import Iterator
from statistics import fmean

from runs import Json, begun, marched

from .table import Line

SIZE, LONGEST, CELLS = 1e-3, 2.5e-4, 8  # of the box, its longest wave [m], and cells of the shortest wave
THICKNESSES = (2, 2.5, 3, 4, 6, 9, 12, 18, 26, 40, 128, 512)  # cells of 128
SLID, PRESSED = 40, 10  # steps of a cell, and before them
AREAS = {"cold": 0.2, "slide": 0.07}
SOLVED = {"cold": 1e-5, "slide": 1e-3}  # tolerances
NEAR = 0.02  # relative, of the contact area
SURFACES = 5
BODIES = [(nu, base) for nu in (0.3, 0.45, 0.5) for base in ("bonded", "smooth")]


def layers(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """The mean over as many surfaces as rounds, five at most; of all thicknesses the one with the largest ratio.

    With less than three rounds there are fewer bodies.
    """
    seeds = range(1, min(rounds, SURFACES) + 1)
    for kind in AREAS:
        for nu, base in BODIES[: 2 * rounds]:
            alone = _calls(kind, points, nu, {}, seeds)
            ratios = {}
            for cells in THICKNESSES:
                thickness = cells * SIZE / 128
                ratios[cells] = _calls(kind, points, nu, {"thickness": thickness, "base": base}, seeds) / alone
            worst = max(ratios, key=lambda cells: ratios[cells])
            yield Line(f"{kind}, nu {nu}, {base}: calls of a half space", alone)
            yield Line(f"ratio at most, at {worst / 128:.3g} of the box", ratios[worst])


def _calls(kind: str, points: int, nu: float, body: Json, seeds: range) -> float:
    return fmean(_at_area(kind, points, nu, body, seed) for seed in seeds)


def _at_area(kind: str, points: int, nu: float, body: Json, seed: int) -> float:
    """Operator calls of a cold solve, or in a step of a slide, under the load that gives the area."""
    pressure, low, high = 1e5, 0.0, float("inf")
    for _ in range(20):
        rows = marched(begun(_job(kind, points, nu, body, seed, pressure)))[0]
        area = rows[-1].measures.contact_area
        if abs(area / AREAS[kind] - 1.0) < NEAR:
            break
        low, high = (pressure, high) if area < AREAS[kind] else (low, pressure)
        guess = pressure * min(max(AREAS[kind] / max(area, 1e-6), 0.1), 10.0)
        pressure = guess if low < guess < high else (low + high) / 2
    return fmean(row.operator_calls for row in (rows[-1:] if kind == "cold" else rows[-SLID:]))


def _job(kind: str, points: int, nu: float, body: Json, seed: int, pressure: float) -> Json:
    waves = {"long_wavelength": LONGEST, "short_wavelength": CELLS * SIZE / points}
    job: Json = {
        "grid": {"points": points, "size": SIZE},
        "surface": {"shape": "rough", "hurst": 0.8, **waves, "rms_slope": 0.05, "seed": seed},
        "material": {"model": "elastic", "shear_modulus": 1e6, "poisson": nu},
        "history": [{"pressure": pressure}],
        "numerics": {"tolerance": SOLVED[kind]},
    }
    if kind == "slide":
        branches = [{"modulus": 2e6, "relaxation_time": 1e-3}, {"modulus": 4e6, "relaxation_time": 1e-4}]
        job["material"] = {"model": "zener", "modulus_inf": 1e6, "poisson": nu, "branches": branches}
        press = {"pressure": pressure, "duration": 1e-2, "time_step": 1e-2 / PRESSED}
        way = {"velocity": 0.05, "distance": SLID * SIZE / points, "cells_per_step": 1}
        job["history"] = [press, {"pressure": pressure, **way}]
    return job | ({"body": body} if body else {})
