"""What this machine does in a second, tried for a moment: how ranks that share it slow each other down, and more."""

import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np

from ..parallel.fft import FFT
from ..parallel.fftw import pyfftw
from ..parallel.slab import Slab
from ..physics.halfspace import HalfSpace
from ..solve.contact import ContactSolver, MeanPressure

TINY = 16  # points of a grid on which all time is that of calls
TRIED_BYTES = 32 << 20  # written to see how fast that is
SLOW_WRITE = 100e6  # bytes per second, where that cannot be seen
REPEATED = 20  # times, for a mean of what is done side by side
FFT_SHARE = 0.7  # of the time of a step; the rest is passes through memory


def load() -> float:
    """How many programs wanted a core in the last minute, on average."""
    return os.getloadavg()[0]


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def per_call(alone: Slab) -> float:
    """Seconds of an operator call, and of what belongs to it, that do not depend on the grid; `alone` is one rank."""
    slab = Slab(alone.comm, TINY, TINY)
    fft, half_space = FFT(slab), HalfSpace((1.0, 1.0))
    solver = ContactSolver(slab, half_space.operator(fft), half_space.inverse(fft), 1.0, 1e-15, 30)
    heights = slab.empty()
    heights[...] = np.random.default_rng(0).random(slab.shape)
    best, pressure = np.inf, slab.zeros()
    for _ in range(3):
        calls, began = slab.tally["operator"], time.process_time()
        solver.solve(heights, MeanPressure(0.1), pressure)
        best = min(best, (time.process_time() - began) / (slab.tally["operator"] - calls))
    return float(best)


def copy_rate() -> float:
    """Bytes per second that are copied in memory."""
    source = np.ones(4 << 20)
    target = np.empty_like(source)
    return source.nbytes / _fastest(lambda: np.copyto(target, source), 5)


def crowding(points: tuple[int, int]) -> float:
    """How much longer a transform and a pass through memory take when every core does them at once.

    Threads stand for processes: neither FFTW nor numpy holds Python's lock here. Their own time is what counts: other
    programs that have the core meanwhile are none of it.
    """
    together = cores()
    if together == 1:
        return 1.0
    shape = min(points[1], 1024), min(points[0], 1024)
    tasks = [_Task(shape) for _ in range(together)]
    slower = [_at_once([task.transform for task in tasks]) / _at_once([tasks[0].transform])]
    slower += [_at_once([task.pass_through for task in tasks]) / _at_once([tasks[0].pass_through])]
    return max(1.0, FFT_SHARE * slower[0] + (1.0 - FFT_SHARE) * slower[1])


class _Task:
    def __init__(self, shape: tuple[int, int]) -> None:
        self.a, self.b, self.c = (pyfftw.zeros_aligned(shape) for _ in range(3))
        self.spectrum = pyfftw.zeros_aligned((shape[0], shape[1] // 2 + 1), dtype=np.complex128)
        self.compiled = pyfftw.FFTW(self.a, self.spectrum, (0, 1), flags=("FFTW_ESTIMATE",))

    def transform(self) -> None:
        self.compiled.execute()

    def pass_through(self) -> None:
        np.add(self.a, self.b, out=self.c)


def _at_once(calls: list[Callable[[], None]]) -> float:
    """Seconds of a call, of the thread's own time, when all are repeated side by side."""
    spent = [0.0] * len(calls)
    start = threading.Barrier(len(calls))

    def repeat(index: int) -> None:
        start.wait()
        began = time.thread_time()
        for _ in range(REPEATED):
            calls[index]()
        spent[index] = (time.thread_time() - began) / REPEATED

    threads = [threading.Thread(target=repeat, args=(index,)) for index in range(len(calls))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return float(np.mean(spent))


def _fastest(call: Callable[[], None], count: int) -> float:
    best = np.inf
    for _ in range(count):
        began = time.process_time()
        call()
        best = min(best, time.process_time() - began)
    return float(best)


def write_rate(directory: Path) -> float:
    """Bytes per second that reach the disk of the nearest directory that there is; a file without a name is written."""
    place = next(path for path in (directory.absolute(), *directory.absolute().parents) if path.is_dir())
    with suppress(OSError), TemporaryFile(dir=place) as file:
        data = os.urandom(TRIED_BYTES)
        began = time.perf_counter()
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
        return TRIED_BYTES / (time.perf_counter() - began)
    return SLOW_WRITE
