"""Part `march` of scripts/bench.py: the velocity step of jobs/paper/fig08_velocity_step.yaml on two ranks."""

import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
from bench_cold import pair
from bench_lines import Line
from bench_scale import WORLD
from mpi4py import MPI

from parcontact import job as jobs
from parcontact.parallel.fft import transform_name
from parcontact.parallel.fftw import pyfftw
from parcontact.parallel.slab import Slab, deal
from parcontact.steady_sliding import start

JOB = Path(__file__).resolve().parents[1] / "jobs" / "paper" / "fig08_velocity_step.yaml"
CELLS = 16  # of the shortest wave, as in the job
LONGEST = 1.25e-4  # [m], half of the longest wave: for small grids


def march(points: int, rounds: int) -> Iterator[Line]:
    """From the steady start through the climb, then rounds of a step of one cell and bare transforms; collective.

    Bare transforms are ours, with the exchange between ranks, and FFTW's passes alone, which exchange nothing, both in
    double precision for all transforms of a step, whatever theirs is; and ours, each in its own precision.
    """
    changes = {"grid.points": points, "surface.0.short_wavelength": min(CELLS * 1e-3 / points, LONGEST)}
    job = jobs.load(JOB, changes)
    slab = Slab(WORLD, points, points)
    run = start.first(job, slab)
    steps = run.steps()
    for step in steps:
        run.advance(step)
        if step.number > run.timeline().spans[0].last:
            break
    held = slab.sum(slab.tally["map bytes at most"])[0] / (8 * points**2)
    bare = passes(slab.comm, points)
    double, single = pair(slab, "float64"), pair(slab, "float32")
    names = [transform_name((points, points), dtype) for dtype in ("float64", "float32")]
    calls = slab.tally["operator"]
    ratios: dict[str, list[float]] = {name: [] for name in ("ours alone", "FFTW's passes alone", "ours, as precise")}
    for step in islice(steps, rounds):
        before = slab.tally.copy()
        seconds = _seconds(partial(run.advance, step))
        made = slab.tally.since(before)
        ours, theirs, own = _seconds(double), _seconds(bare), _seconds(single)
        in_double, in_single = (0.5 * made.get(name, 0) for name in names)
        pairs = in_double + in_single
        for name, took in zip(ratios, (pairs * ours, pairs * theirs, in_double * ours + in_single * own), strict=True):
            ratios[name].append(seconds / took)
    yield Line("march", "operator calls per step", (slab.tally["operator"] - calls) / rounds, "")
    for name, values in ratios.items():
        low, middle, high = np.quantile(values, (0.25, 0.5, 0.75)).tolist()
        yield Line("march", f"a step over its transforms by {name}", middle, "", low, high)
    yield Line("march", "held at most, the steady start included", held, "maps")
    yield Line("march", "the same without one for each branch", held - len(run.scene.material.branches), "maps")


def passes(comm: MPI.Intracomm, points: int) -> Callable[[], None]:
    """Along x and y there and back, of this rank's rows and columns; collective."""
    rows, columns = (deal(count, comm.size)[comm.rank] for count in (points, points // 2 + 1))
    height, width = rows.stop - rows.start, columns.stop - columns.start
    heights = pyfftw.zeros_aligned((height, points), "float64", n=64)
    waves = pyfftw.zeros_aligned((height, points // 2 + 1), "complex128", n=64)
    spectrum = pyfftw.zeros_aligned((points, width), "complex128", n=64)
    measured = ("FFTW_MEASURE",)
    plans = [
        pyfftw.FFTW(heights, waves, (1,), "FFTW_FORWARD", measured),
        pyfftw.FFTW(spectrum, spectrum, (0,), "FFTW_FORWARD", measured),
        pyfftw.FFTW(spectrum, spectrum, (0,), "FFTW_BACKWARD", measured),
        pyfftw.FFTW(waves, heights, (1,), "FFTW_BACKWARD", (*measured, "FFTW_DESTROY_INPUT")),
    ]

    def call() -> None:
        for plan in plans:
            plan.execute()

    return call


def _seconds(way: Callable[[], object]) -> float:
    """Of the slowest rank; collective."""
    WORLD.Barrier()
    began = time.perf_counter()
    way()
    return float(WORLD.allreduce(time.perf_counter() - began, MPI.MAX))
