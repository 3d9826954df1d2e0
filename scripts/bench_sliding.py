"""Parts `slide`, `steady` and `memory` of scripts/bench.py: sliding step by step and directly, and what a run holds."""

import argparse
import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bench_backward_euler import beside_peers
from bench_cold import pair
from bench_lines import Line, Map, interleave
from bench_slid import slid
from mpi4py import MPI

from parcontact import job as jobs
from parcontact import scene
from parcontact.march.loop import March, run
from parcontact.parallel.slab import Slab
from parcontact.plan import memory
from parcontact.steady_sliding.sliding import SteadySliding
from parcontact.storage.row import Row

DEFAULT, EXACT = 5e-3, 5e-5  # tolerances of a job that gives none, and of one to compare with
LARGER = (0.1, 0.05, 0.02, 0.01)
ERROR = 1e-3  # of friction
FEWEST = 8  # steps: the first ones are not like the others
SLIDING = """\
grid: {{points: {points}, size: 1.0e-3}}
surface: {{shape: rough, hurst: 0.9, long_wavelength: 2.5e-4, short_wavelength: {short!r}, rms_slope: 0.02, seed: 1}}
material: {{include: synthetic_tyre}}
history: [{{pressure: 1.0e5, velocity: 0.3, distance: {distance!r}, cells_per_step: 1}}]
numerics: {{tolerance: {tolerance!r}}}
"""


def sliding_job(points: int, steps: int, tolerance: float = DEFAULT) -> jobs.Job:
    with tempfile.TemporaryDirectory() as directory:
        path, distance = Path(directory, "job.yaml"), steps * 1e-3 / points
        chosen = {"points": points, "short": min(1.6e-2 / points, 1e-4), "distance": distance, "tolerance": tolerance}
        path.write_text(SLIDING.format(**chosen))
        return jobs.load(path)


def slide(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """With twelve branches, and beside peers with eight."""
    yield from _slide_a_compound(points, rounds)
    if asked.peers is not None:
        yield from beside_peers(points, asked.peers)


def _slide_a_compound(points: int, rounds: int) -> Iterator[Line]:
    """Means over the second half of the steps: at the default tolerance, and at the largest one with which friction is
    nowhere wrong by more than ERROR."""
    steps = max(4 * rounds, FEWEST)
    half = steps // 2
    exact = _friction(slid(sliding_job(points, steps, EXACT))[1][half:])
    for tolerance in (DEFAULT, *LARGER):
        march, seen, clock = slid(sliding_job(points, steps, tolerance))
        rows, at = seen[half:], f"tolerance {tolerance:g}"
        error = float(np.abs(_friction(rows) / exact - 1.0).max())
        if tolerance != DEFAULT and error > ERROR:
            continue
        yield Line("slide", f"{at}: largest error of friction", error, "")
        yield Line("slide", f"{at}: operator calls per step", statistics.fmean(row.operator_calls for row in rows), "")
        yield Line("slide", f"{at}: iterations per step", statistics.fmean(row.iterations for row in rows), "")
        step = statistics.median(np.diff(clock)[half:].tolist())
        bare = statistics.median(interleave({"pair": pair(march.scene.slab, "float64")}, 10)["pair"])
        yield Line("slide", f"{at}: a step", 1e3 * step, "ms")
        yield Line("slide", f"{at}: a step over a transform and its inverse", step / bare, "")
        if tolerance != DEFAULT:
            break


def _friction(rows: list[Row]) -> Map:
    return np.array([row.measures.friction for row in rows])


def steady(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    base = scene.set_up(sliding_job(points, 1), Slab(MPI.COMM_SELF, points, points))
    for speed in (0.01, 0.3, 10.0):
        calls = SteadySliding(base).solve((speed, 0.0), 1e5).operator_calls
        yield Line("steady", f"cold at {speed:g} m/s: operator calls", calls, "")
    sliding = SteadySliding(base)
    curve = [sliding.solve((0.03 * 10 ** (k / 8), 0.0), 1e5).operator_calls for k in range(min(17, rounds + 2))]
    yield Line("steady", "curve: operator calls per further point", statistics.fmean(curve[1:]), "")
    yield Line("steady", "curve: the most of them", max(curve[1:]), "")


def held(points: int, _: int, __: argparse.Namespace) -> Iterator[Line]:
    planned = sliding_job(points, 2)
    slab = Slab(MPI.COMM_SELF, points, points)
    march = March(scene.build(planned, slab))
    begun = slab.tally["map bytes"]
    run(march, [])
    yield Line("memory", "planned", memory.total(planned) / 1e6, "MB")
    yield Line("memory", "held", begun / 1e6, "MB")
    yield Line("memory", "held at most, the first solve included", slab.tally["map bytes at most"] / 1e6, "MB")
    yield Line("memory", "held at most, in maps", slab.tally["map bytes at most"] / (8 * points * points), "")
