"""What the distributed FFT costs, as ratios measured in one run: `.venv/bin/python scripts/bench_fft.py [--points N]`.

Starts itself under mpirun. Each round times a forward and backward transform three ways, one after the other, so that
all meet the same machine: FFTW alone (`bare`), ours on one rank, ours on several. Compared are the fastest rounds,
which others who use the machine disturb least; the median of the ratios of each round stands beside them.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

BARE_LIMIT = 1.15  # ours on one rank over FFTW alone
RANKS_LIMIT = 0.7  # two ranks over one; the goal is 0.6


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=2048, help="along x and y")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--precision", choices=("float64", "float32"), default="float64")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def start(ranks: int) -> int:
    print(f"others keep {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores busy (mean of the last minute)", flush=True)
    mpirun = Path(sys.executable).with_name("mpirun")
    return subprocess.run([mpirun, "-n", str(ranks), sys.executable, *sys.argv, "--inside"]).returncode


def measure(points: int, rounds: int, precision: str) -> None:
    import numpy as np
    from mpi4py import MPI

    from parcontact.parallel.fft import FFT
    from parcontact.parallel.slab import Slab

    world = MPI.COMM_WORLD
    first = world.Split(world.rank > 0)  # of rank 0: itself alone

    def ours(comm: MPI.Intracomm) -> Callable[[], object]:
        slab = Slab(comm, points, points)
        fft, heights, out = FFT(slab, dtype=precision), slab.empty(precision), slab.zeros(precision)
        heights[...] = np.random.default_rng(1).random(slab.shape)
        return lambda: fft.backward(fft.forward(heights), out)

    alone = {"bare": bare(points, precision), "one rank": ours(first)} if world.rank == 0 else {}
    together = ours(world)
    times: dict[str, list[float]] = {"bare": [], "one rank": [], "ranks": []}
    for _ in range(rounds):
        for name, pair in alone.items():
            times[name].append(seconds(pair))
        quiet_barrier(world)
        times["ranks"].append(seconds(together, world.Barrier))
    if world.rank == 0:
        print(f"{points} x {points} {precision}, forward and backward, fastest of {rounds} rounds:")
        report("FFTW alone", times["bare"])
        report("one rank", times["one rank"], times["bare"], BARE_LIMIT)
        report(f"{world.size} ranks", times["ranks"], times["one rank"], RANKS_LIMIT if world.size == 2 else None)


def bare(points: int, precision: str) -> Callable[[], object]:
    """Two-dimensional transforms as FFTW makes them by itself."""
    import numpy as np
    import pyfftw

    complex_type = {"float64": "complex128", "float32": "complex64"}[precision]
    heights, out = (pyfftw.zeros_aligned((points, points), precision, n=64) for _ in range(2))
    waves = pyfftw.zeros_aligned((points, points // 2 + 1), complex_type, n=64)
    forward = pyfftw.FFTW(heights, waves, (0, 1), "FFTW_FORWARD", ("FFTW_MEASURE",))
    backward = pyfftw.FFTW(waves, out, (0, 1), "FFTW_BACKWARD", ("FFTW_MEASURE", "FFTW_DESTROY_INPUT"))
    heights[...] = np.random.default_rng(1).random(heights.shape)
    return lambda: (forward.execute(), backward.execute())


def seconds(pair: Callable[[], object], wait: Callable[[], object] = lambda: None) -> float:
    """Of the second of two calls: the first brings the maps back into the cache."""
    pair()
    wait()
    begin = time.perf_counter()
    pair()
    wait()
    return time.perf_counter() - begin


def quiet_barrier(world) -> None:
    """Ranks that wait here leave the machine to the others."""
    arrival = world.Ibarrier()
    while not arrival.Test():
        time.sleep(1e-3)


def report(name: str, times: list[float], base: list[float] | None = None, limit: float | None = None) -> None:
    line = f"  {name:<12}{1e3 * min(times):8.2f} ms"
    if base:
        ratio, median = min(times) / min(base), statistics.median(a / b for a, b in zip(times, base, strict=True))
        line += f"   {ratio:.3f} of the line above, {median:.3f} in the median"
        line += f" (at most {limit}: {'yes' if ratio <= limit else 'NO'})" if limit else ""
    print(line, flush=True)


if __name__ == "__main__":
    given = arguments()
    if not given.inside:
        sys.exit(start(given.ranks))
    measure(given.points, given.rounds, given.precision)
