"""Load taken away: recovery, memory, and contact that is lost while the surface is still deep."""

import numpy as np

from ..march.step import March
from ..theory import lee_radok
from .bench import Bench
from .jobs import CREEP, PRONY, RADIUS, sphere

FORCE = 0.15  # N
ENOUGH = {"tolerance": 1e-6}  # where a cell is a tenth of the contact


def load_again(bench: Bench) -> None:
    """Without load the body recovers with the creep time, not the relaxation time; it remembers, and then forgets."""
    steps = {"first": 1e-4, "growth": 1.12}
    press = {"force": FORCE, "duration": CREEP, "time_step": steps}
    rest = {"force": 0.0, "duration": CREEP, "time_step": 2.5e-4}
    long_rest = {"force": 0.0, "duration": 10 * CREEP, "time_step": {"first": 4e-4, "growth": 1.02}}
    middle: list[tuple[float, float]] = []

    def keep(march: March) -> None:
        if march.row.measures.pressure == 0.0:
            middle.append((march.row.time, bench.whole(march, "displacement")[16, 16]))

    _, rows = bench.march(sphere([press, rest, {"force": FORCE}], size=2e-3, numerics=ENOUGH), keep)
    virgin, again = rows[1].measures, rows[-1].measures
    t, u = np.array(middle).T
    bench.expect("at once", virgin.approach, 21.869e-6, 5e-3)
    bench.expect("snap back", u[0], 67.231e-6, 5e-3)
    bench.expect_all("recovery", u / u[0], np.exp(-(t - t[0]) / CREEP), 2e-3)
    unloaded = [row.measures for row in rows if row.measures.pressure == 0.0]
    bench.expect("pressure without load", max(measures.max_pressure for measures in unloaded), 0.0, 0.0)
    bench.expect("approach again", again.approach, 43.877e-6, 1e-2)
    bench.expect("area again over virgin", again.contact_area / virgin.contact_area, (0.537 / 0.470) ** 2, 0.1)
    _, rows = bench.march(sphere([press, long_rest, {"force": FORCE}], size=2e-3, numerics=ENOUGH))
    bench.expect("approach after a long rest", rows[-1].measures.approach, virgin.approach, 5 * np.exp(-10.0))


def retraction(bench: Bench) -> None:
    """Ting: a sphere pressed in and pulled back lets go while it is still deep; its force is never negative."""
    depth, rise, steps = 5e-5, 1e-3, 25
    ramps = ((0.0, depth), (depth, 0.0))
    history = [{"approach": {"from": a, "to": b}, "duration": rise, "time_step": rise / steps} for a, b in ramps]
    _, rows = bench.march(sphere(history, size=2e-3, numerics=ENOUGH))
    t = np.array([row.time for row in rows])
    force = np.array([row.measures.pressure for row in rows]) * 2e-3**2
    exact = lee_radok.triangle_force(t, depth, rise, RADIUS, *PRONY)
    bench.expect_all("force", force, exact, 1e-2)
    lift_off = lee_radok.triangle_lift_off_time(rise, *PRONY)
    bench.expect("lift-off", t[np.flatnonzero(force)[-1]], lift_off, rise / steps / lift_off)
    bench.expect("force after", force[t > lift_off].max(), 0.0, 0.0)
    bench.expect("area after", max(row.measures.contact_area for row in rows if row.time > lift_off), 0.0, 0.0)
