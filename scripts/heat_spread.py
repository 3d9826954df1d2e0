"""What one flash temperature for all rubber leaves out, for jobs/heat: friction at the quartiles of the temperature
over the contact, and what the depth at which heat is taken to lie does to the flash temperature.

    .venv/bin/python scripts/heat_spread.py [--speeds 0.1 1 10] [--points 128]
"""

import argparse
from dataclasses import replace
from pathlib import Path

from parcontact import job, scene
from parcontact.parallel.slab import Slab
from parcontact.physics.flash import flash_of, spread_over
from parcontact.physics.heat import Depths, depths_of, sliding_heat
from parcontact.steady_sliding.point import Point
from parcontact.steady_sliding.sliding import SteadySliding

JOB = Path(__file__).resolve().parents[1] / "jobs" / "heat" / "friction.yaml"
PRESSURE, COLD = 5e5, 20.0


def states(*overrides: str) -> SteadySliding:
    made = job.load(JOB, overrides)
    return SteadySliding(scene.set_up(made, Slab.alone(*made.grid.points)))


def at_depth(sliding: SteadySliding, point: Point, times: float) -> float:
    """Return the flash temperature [K] of a state if its heat lay so many times as deep."""
    setup, contact = sliding.setup, sliding.contact
    assert contact is not None
    found = depths_of(
        setup.fft.forward(contact.p), setup.fft, setup.half_space, setup.units.length, point.velocity, setup.prony
    )
    depths = Depths(found.wavenumbers / times, found.shares)
    heat = spread_over(setup.slab, contact.p, point.friction * point.pressure * point.speed)
    section = setup.job.section("thermal")
    place = setup.fft, setup.grid.size, section.conductor, point.velocity
    time = section.sliding_time(setup.grid, point.speed)
    rise = sliding_heat(*place, depths, felt=True, time=time).apply(heat, setup.slab.empty())
    return flash_of(setup.slab, rise, [(rise, heat)]).mean


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--speeds", type=float, nargs="+", default=(0.1, 1.0, 10.0), help="[m/s]")
    parser.add_argument("--points", type=int, default=128, help="points along a side")
    options = parser.parse_args()
    mesh = f"grid.points={options.points}"
    hot, cold = states(mesh), states(mesh, "thermal.feedback=none")
    print("velocity  flash [K]  quartiles [K]   friction  at the quartiles    flash, half and twice as deep [K]")
    for speed in options.speeds:
        hot.heat(COLD)
        point = hot.solve((speed, 0.0), PRESSURE)
        flash = point.flash
        assert flash is not None
        near = []
        for rise in (flash.lower, flash.upper):
            cold.heat(COLD + rise)
            near.append(cold.solve((speed, 0.0), PRESSURE).friction)
        deep = [at_depth(hot, replace(point), times) for times in (0.5, 2.0)]
        print(
            f"{speed:8g} {flash.mean:10.2f} {flash.lower:7.2f} {flash.upper:7.2f} {point.friction:10.4f} "
            f"{near[0]:9.4f} {near[1]:8.4f} {deep[0]:15.2f} {deep[1]:8.2f}"
        )


if __name__ == "__main__":
    main()
