"""Checks of an installation that have exact answers, and the table of what came out."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import RunError
from ..physics import prony as viscoelastic
from ..theory import full_contact, lee_radok, persson, persson_rings, westergaard
from .bench import Bench
from .small_jobs import GLASSY, HEIGHT, PRONY, RADIUS, RELAXATION, WAVELENGTH, K, sphere, wave, zener

ITERATIONS = 60  # tuning: a contact may take this many at most
RUBBER = zener(GLASSY, [], [])
WAVES = ((1, 0, 1.0), (2, 1, 0.5), (0, 2, 0.4), (1, -3, 0.3), (4, 3, 0.1), (-5, 4, 0.1))  # and their heights


@dataclass(frozen=True)
class Check:
    """A small calculation with an exact answer: `run` makes it on a bench and tells the bench what is expected."""

    name: str
    expected: str
    run: Callable[[Bench], None]


def run_check(check: Check, bench: Bench) -> Bench:
    """Run a check on a bench of its own, and return that; collective. A solve that fails is a finding too."""
    try:
        check.run(bench)
    except RunError as error:
        bench.failure = str(error)
    return bench


def markdown(results: Iterable[tuple[Check, Bench]]) -> str:
    """Return the table of results, numbered from 1."""
    head = ("", "case", "expected", "came out, nearest to its limit [SI]", "residual", "iterations", "")
    lines: list[tuple[str, ...]] = [head]
    for number, (check, bench) in enumerate(results, start=1):
        cost = f"{bench.residual:.0e}", str(bench.iterations)
        verdict = "WRONG" if bench.wrong else "ok"
        lines.append((str(number), check.name, check.expected, bench.nearest, *cost, verdict))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    lines.insert(1, tuple("-" * width for width in widths))
    return "\n".join("| " + " | ".join(map(str.ljust, line, widths)) + " |" for line in lines)


def nearly_full(bench: Bench) -> None:
    """Westergaard's wave at 0.99, 1 and 1.01 of the load that closes the last gap."""
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
    """Many waves in full contact, sliding: the force is the sum over them, in closed form, steady and of steps, and
    after Persson for any gamma."""
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
    """Ting: a sphere pressed in and pulled back lets go while it is still deep; its force is never negative."""
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
    Check("sphere pulled back", "Ting: lift-off while still deep", retraction),
    Check("full contact of many waves, sliding", "sum over the waves", closed_by_load),
)
