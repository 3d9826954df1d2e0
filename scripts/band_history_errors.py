"""Compare bands over time with one grid that holds all waves: friction and area over slip from rest, and after a change
of velocity.

Both have four cells per shortest wave. They differ by the method, by the random surfaces and by the mesh. Areas are
corrected ones. Each event has a line for its friction over the slips from half a cell to the end, equally spaced in the
logarithm: mean, rms and largest difference, and the rms of the area; highest friction and friction at the end on one
grid and in bands; the stated errors, and the share of slips at which they cover the difference. With --points 256 an
event takes a minute of one core, with 512 some ten.

    python scripts/band_history_errors.py --events 0,1 --points 256 --samples 2
"""

import argparse
import sys
import time
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from parcontact import job as jobs
from parcontact.bands.road_history import RoadHistory
from parcontact.parallel.slab import Slab

LONG, SLIP = 1e-3, 1.2e-3  # m
SLIPS = 40  # slips that are compared
TYRE = {"include": "synthetic_tyre"}


def zener(modulus_inf: float, *branches: tuple[float, float]) -> dict[str, Any]:
    """Return a material with branches of these moduli [Pa] and relaxation times [s]."""
    each = [{"modulus": modulus, "relaxation_time": seconds} for modulus, seconds in branches]
    return {"model": "zener", "modulus_inf": modulus_inf, "branches": each}


THREE = zener(0.3e6, (2e6, 1e-6), (0.6e6, 1e-4), (0.2e6, 1e-2))
ONE = zener(1e6, (2e7, 1e-3))
BROAD = zener(2e6, *((3e6 * 1.6**k, 10.0 ** (1 - k)) for k in range(9)))


class Event(NamedTuple):
    """A change of velocity [m/s] `after` a rest [s], or after steady sliding at `before` [m/s]."""

    name: str
    material: dict[str, Any]
    hurst: float
    slope: float
    pressure: float
    velocity: float
    rest: float = 1e3
    before: float = 0.0
    count: int = 2


EVENTS = (
    Event("tyre, long rest", TYRE, 0.8, 0.25, 0.953e6, 0.1),
    Event("tyre, 0.1 to 10 m/s", TYRE, 0.8, 0.25, 0.953e6, 10.0, before=0.1),
    Event("tyre, long rest", TYRE, 0.8, 0.25, 0.953e6, 0.1, count=3),
    Event("tyre, rest of 1 ms", TYRE, 0.8, 0.25, 0.953e6, 0.1, rest=1e-3, count=3),
    Event("three branches, long rest", THREE, 0.7, 0.3, 18.9e3, 0.02),
    Event("one branch, long rest", ONE, 0.8, 0.25, 1e5, 0.25),
    Event("broad, long rest", BROAD, 0.6, 0.15, 5e5, 1.0),
    Event("broad, 1 to 0.01 m/s", BROAD, 0.9, 0.1, 1e5, 0.01, before=1.0),
    Event("tyre, rest of 1 s", TYRE, 0.5, 0.2, 3e6, 1.0, rest=1.0),
    Event("three branches, rest of 0.1 s", THREE, 0.8, 0.1, 2e4, 0.3, rest=0.1),
)


class History(NamedTuple):
    """Slips [m] after the change, friction, corrected area and their stated relative errors; seconds of this run."""

    slips: NDArray[np.float64]
    friction: NDArray[np.float64]
    area: NDArray[np.float64]
    errors: NDArray[np.float64]
    seconds: float

    def at(self, slips: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.interp(np.log(slips), np.log(self.slips), values)


def calculate(event: Event, count: int, points: int, samples: int) -> History:
    """Return the history of an event in bands; `points` are those of one grid."""
    along = points if count == 1 else 2 * round(8 * (points / 16) ** (1 / count))
    surface = {"shape": "rough", "hurst": event.hurst, "rms_slope": event.slope, "seed": 1, "amplitudes": "fixed"}
    slide: dict[str, Any] = {"pressure": event.pressure, "velocity": event.velocity, "distance": SLIP}
    job: dict[str, Any] = {
        "surface": {**surface, "long_wavelength": LONG, "short_wavelength": 16 * LONG / points},
        **{"material": event.material, "numerics": {"tolerance": 2e-3}},
        "bands": {"count": count, "points": along, "samples": samples},
    }
    if event.before:
        job["initial"] = {"state": "steady", "velocity": event.before, "pressure": event.pressure}
        job["history"] = [slide]
    else:
        job["history"] = [{"pressure": event.pressure, "duration": event.rest}, slide]
    began = time.process_time()
    road = RoadHistory(jobs.load(job), Slab.alone(1, 1))
    road.march(lambda *of_round: None)
    rows = [row for row, _ in road.records() if row.distance > 0.0]
    measures = np.array([(row.distance, row.measures.friction, row.measures.contact_area_corrected) for row in rows])
    errors = np.array([(row.error_friction, row.error_area) for row in rows])
    return History(*measures.T, errors.T, time.process_time() - began)


@cache
def on_one_grid(number: int, points: int, samples: int) -> History:
    return calculate(EVENTS[number], 1, points, samples)


def same_scene(number: int) -> int:
    """Return the number of the first event that differs from this one in the bands only."""
    return next(k for k, event in enumerate(EVENTS) if event._replace(count=0) == EVENTS[number]._replace(count=0))


def compare(number: int, points: int, samples: int, count: int) -> list[bool]:
    """Print how bands differ from one grid; return whether the stated error covers friction at the peak, at the end,
    and on average over all slips."""
    event = EVENTS[number]
    whole, found = on_one_grid(same_scene(number), points, samples), calculate(event, count, points, samples)
    slips = np.geomspace(max(whole.slips[0], found.slips[0]), SLIP, SLIPS)
    one, bands = whole.at(slips, whole.friction), found.at(slips, found.friction)
    areas = found.at(slips, found.area) / whole.at(slips, whole.area) - 1.0
    error, stated = bands / one - 1.0, found.at(slips, found.errors[0])
    covered = np.abs(error) <= stated
    peaks = one.max(), bands.max()
    print(
        f"{number} {event.name}, {count} bands: friction mean {100 * error.mean():+.1f}, rms "
        f"{100 * np.sqrt(np.mean(error**2)):.1f}, largest {100 * np.abs(error).max():.1f} %, area rms "
        f"{100 * np.sqrt(np.mean(areas**2)):.1f} %, peak {peaks[0]:.4f} -> {peaks[1]:.4f} "
        f"({100 * (peaks[1] / peaks[0] - 1):+.1f} %), end {one[-1]:.4f} -> {bands[-1]:.4f} ({100 * error[-1]:+.1f} %), "
        f"area at the end {whole.area[-1]:.4f}; stated {100 * stated.mean():.1f} %, covers {100 * covered.mean():.0f} "
        f"% of slips; {whole.seconds:.0f} s and {found.seconds:.0f} s",
        flush=True,
    )
    return [bool(covered.mean() >= 0.9)]


def main(arguments: Sequence[str] | None = None) -> int:
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--events", default=",".join(map(str, range(len(EVENTS)))), help="numbers of events")
    asked.add_argument("--points", type=int, default=256, help="points along a side of one grid")
    asked.add_argument("--samples", type=int, default=2, help="surfaces of each band, and of one grid")
    options = asked.parse_args(arguments)
    numbers = [int(number) for number in options.events.split(",")]
    found = [compare(number, options.points, options.samples, EVENTS[number].count) for number in numbers]
    print(f"the stated error covers nine of ten slips in {sum(map(any, found))} of {len(found)} events")
    return 0


if __name__ == "__main__":
    sys.exit(main())
