"""Checks of an installation against exact solutions, and the table of results."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import RunError
from ..physics import prony as viscoelastic
from ..theory import full_contact, lee_radok, persson, persson_rings, westergaard
from .bench import Bench
from .small_jobs import GLASSY, HEIGHT, PRONY, RADIUS, RELAXATION, WAVELENGTH, K, sphere, wave, zener

ITERATIONS = 60  # tuning: limit on the iterations of a contact solve
RUBBER = zener(GLASSY, [], [])
WAVES = ((1, 0, 1.0), (2, 1, 0.5), (0, 2, 0.4), (1, -3, 0.3), (4, 3, 0.1), (-5, 4, 0.1))  # nx, ny, height/HEIGHT


@dataclass(frozen=True)
class Check:
    """A small calculation with an exact solution: `run` performs it on a bench, and records results there."""

    name: str
    expected: str
    run: Callable[[Bench], None]


def run_check(check: Check, bench: Bench) -> Bench:
    """Run a check on a bench, and return the bench; collective. A failed solve is recorded as its failure."""
    try:
        check.run(bench)
    except RunError as error:
        bench.failure = str(error)
    return bench


def markdown(results: Iterable[tuple[Check, Bench]]) -> str:
    """Return the table of results in Markdown."""
    head = ("", "case", "expected", "result nearest to its limit [SI]", "residual", "iterations", "")
    lines: list[tuple[str, ...]] = [head]
    for number, (check, bench) in enumerate(results, start=1):
        cost = f"{bench.residual:.0e}", str(bench.iterations)
        verdict = "WRONG" if bench.wrong else "ok"
        lines.append((str(number), check.name, check.expected, bench.nearest, *cost, verdict))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    lines.insert(1, tuple("-" * width for width in widths))
    return "\n".join("| " + " | ".join(map(str.ljust, line, widths)) + " |" for line in lines)


def nearly_full(bench: Bench) -> None:
    """Check Westergaard's wave at 0.99, 1 and 1.01 of the load of full contact."""
    for share in (0.99, 1.0, 1.01):
        mean = share * float(westergaard.full_contact_pressure(HEIGHT, WAVELENGTH, GLASSY))
        job = wave([{"pressure": mean}, {"pressure": mean}], points=(256, 1), material=RUBBER)
        march, rows = bench.march(job)
        x = np.arange(256) * WAVELENGTH / 256
        exact = westergaard.pressure(x, mean, HEIGHT, WAVELENGTH, GLASSY)
        bench.expect_all("Westergaard", bench.whole(march, "pressure")[0], exact, 1e-9 if share > 1 else 5e-3)
        area = float(westergaard.contact_fraction(mean, HEIGHT, WAVELENGTH, GLASSY))
        bench.expect("area", rows[-1].measures.contact_area, area, 2 / 256 if share <= 1 else 0.0, scale=1.0)
    bench.expect("iterations", bench.iterations, 0.0, ITERATIONS, scale=1.0)


def closed_by_load(bench: Bench) -> None:
    """Check sliding in full contact of many waves: steady and stepped forces are sums over waves in closed form, and
    the steady friction agrees with Persson's theory for any gamma."""
    velocity, points = 0.3 * WAVELENGTH / RELAXATION, 16
    surface = [
        {"shape": "wave", "amplitude": share * HEIGHT, "waves": [x, y], "phase": 1.0 * x} for x, y, share in WAVES
    ]
    start = {"state": "steady", "velocity": velocity, "pressure": 1e6}
    stage = {"pressure": 1e6, "velocity": velocity, "distance": 5 * WAVELENGTH, "cells_per_step": 1}
    _, rows = bench.march(wave([stage], points=(points, points), surface=surface, initial=start))
    x, y, share = np.array(WAVES).T
    rings = persson_rings.rings_of_surface(full_contact.Waves((share * HEIGHT).astype(complex), K * x, K * y))
    omega = rings.waves.kx * velocity
    exact = viscoelastic.complex_modulus(omega, *PRONY)
    discrete = viscoelastic.discrete_modulus(omega, WAVELENGTH / points / velocity, *PRONY)
    for what, row, modulus in (("force", rows[0], exact), ("force of steps", rows[-1], discrete)):
        forces = full_contact.traction(*rings.waves, modulus) * WAVELENGTH**2
        bench.expect_all(what, [row.measures.force_x, row.measures.force_y], forces, 1e-8)
        for gamma in (0.0, 1.0):
            friction = -row.measures.force_x / (1e6 * WAVELENGTH**2)
            expected = persson.friction_coefficient(1e6, rings, velocity, 0.0, modulus, gamma)
            bench.expect("friction", friction, float(expected), 1e-8)
    bench.expect("area", min(row.measures.contact_area for row in rows), 1.0, 0.0)


def retraction(bench: Bench) -> None:
    """Check a sphere pressed in and pulled back (Ting): contact ends while its approach is still positive."""
    depth, rise, steps = 5e-5, 1e-3, 25
    ramps = ((0.0, depth), (depth, 0.0))
    history = [{"approach": {"from": a, "to": b}, "duration": rise, "time_step": rise / steps} for a, b in ramps]
    _, rows = bench.march(sphere(history, size=2e-3, numerics={"tolerance": 1e-6}))
    t = np.array([row.time for row in rows])
    force = np.array([row.measures.pressure for row in rows]) * 2e-3**2
    exact = lee_radok.triangle_force(t, depth, rise, RADIUS, *PRONY)
    bench.expect_all("force", force, exact, 1e-2)
    lift_off = lee_radok.triangle_lift_off_time(rise, *PRONY)
    bench.expect("lift-off", t[np.flatnonzero(force)[-1]], lift_off, rise / steps / lift_off)
    bench.expect("force after", force[t > lift_off].max(), 0.0, 0.0)
    bench.expect("area after", max(row.measures.contact_area for row in rows if row.time > lift_off), 0.0, 0.0)


CHECKS = (
    Check("0.99, 1 and 1.01 of full contact", "Westergaard; 60 iterations", nearly_full),
    Check("sphere pulled back", "Ting: lift-off before approach 0", retraction),
    Check("full contact of many waves, sliding", "sum over the waves", closed_by_load),
)
