"""Reasons to stop early or to save, and options of runs and friction curves.

Signals may reach any rank; root knows the stop files and the limit of wall time. One small message per step or point
brings the decision to all ranks.
"""

import os
import secrets
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import Doubt
from ..job import Checkpoint
from ..parallel.root import Signals
from ..parallel.slab import Slab
from .outputs import Directory


@dataclass(frozen=True)
class StopFile:
    """A stop file shared by all programs of a sweep. None of these programs removes it.

    The file stops programs that are running when it is created or touched: a file that was last changed at the time
    `before` [ns] has no effect. The ranks of one program stop each other by a second file, `own`.
    """

    path: Path
    before: int
    own: Path

    @classmethod
    def from_now_on(cls, path: Path) -> "StopFile":
        """Return a stop file that has an effect if it is created or touched after this call."""
        return cls(path, _touched(path), path.with_name(f".{path.name}-{secrets.token_hex(8)}"))

    @property
    def asks(self) -> bool:
        return self.own.exists() or _touched(self.path) not in (0, self.before)

    def ask_own(self) -> None:
        """Stop the other ranks of this program by the file `own`. If this file cannot be written, the other ranks go on
        with their cases."""
        with suppress(OSError):
            self.own.touch()

    def forget_own(self) -> None:
        """Remove the file `own`, after all ranks have ended."""
        with suppress(OSError):
            self.own.unlink(missing_ok=True)


def remove(path: Path) -> str:
    """Remove a stop file. Return a message if this fails, or ''."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        return f"stopped by {path}, which cannot be removed: {os.strerror(error.errno or 0)}; remove it"
    return ""


def _touched(path: Path) -> int:
    """Return the time of the last change of a file [ns], 0 without a file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def always(doubt: Doubt) -> bool:
    """Return True: all warnings are shown."""
    return True


@dataclass(frozen=True)
class Options:
    """Options of a run or a curve.

    `until` is the time in the history [s] at which the run ends, None for the end of the history. `wall` is the limit
    of the time since the start of the program [s], None without a limit. `sweep_stop_file` stops all cases of a sweep,
    and no case removes it. `shows` returns True for a warning that is to be printed; other warnings go into run.log
    only.
    """

    quiet: bool = False
    restart: str = "auto"
    until: float | None = None
    wall: float | None = None
    sweep_stop_file: StopFile | None = None
    shows: Callable[[Doubt], bool] = always


LOOK_SECONDS = 0.2  # tuning: least time between checks for the stop file [s]
RESERVE_SECONDS = 5.0  # tuning: wall time reserved for the end of MPI and of files [s]
FIRST_WRITE = 50e6  # tuning: expected writing rate of the first checkpoint [bytes/s]
RECENT = 50  # tuning: number of recent steps, the longest of which is expected for the next one

GO, WALL, FILE, SIGNAL = range(4)  # the largest reason on any rank decides
REASONS = {WALL: "the wall time is nearly used up", FILE: "the stop file was found", SIGNAL: "a signal was received"}


@dataclass(frozen=True)
class Verdict:
    """Decision of all ranks after a step. `stop` is the reason why the run stops early, and `problem` the reason why it
    fails; both are '' if it goes on. `save` is True if a checkpoint is due."""

    stop: str = ""
    save: bool = False
    problem: str = ""


@dataclass
class Watch:
    """Decides after every step whether the run goes on. `limit` is the time (of `time.monotonic`) at which the run must
    have ended, None without a limit. The file `sweep_stop_file` stops all cases of a sweep, and the run does not remove
    it."""

    slab: Slab
    rules: Checkpoint
    stop_file: Path
    signals: Signals
    limit: float | None = None
    sweep_stop_file: StopFile | None = None
    state_bytes: int = 0
    _saved: float = field(default_factory=time.monotonic)
    _looked: float = 0.0
    _made: int = 0
    _last: float = field(default_factory=time.monotonic)  # or the first step would be as long as the machine is up
    _write: float = -1.0
    _steps: deque[float] = field(default_factory=lambda: deque(maxlen=RECENT))

    def decide(self, step: int, began: bool, problem: str = "") -> Verdict:
        """Return the decision after a step. Collective. `began` is True if this run has made a step, and `problem` is a
        failure on root, or ''."""
        now = time.monotonic()
        if began:
            self._steps.append(now - self._last)
        self._last = now
        codes = [SIGNAL * self.signals.stop, self.signals.save, 0]
        self.signals.save = False
        if self.slab.root:
            codes = [max(codes[0], self._stop(now, began)), codes[1] or self._due(step, now, began), bool(problem)]
        self._made = step
        stop, save, failed = self.slab.reduce((), codes)
        if failed:
            return Verdict(problem=self.slab.agree(problem))
        if stop == FILE and (problem := self.slab.agree(remove(self.stop_file) if self.slab.root else "")):
            return Verdict(problem=problem)
        return Verdict(REASONS.get(int(stop), ""), bool(save))

    def saved(self, seconds: float) -> None:
        """Record that a checkpoint was written in `seconds` [s]."""
        self._write = seconds
        self._saved = self._last = time.monotonic()

    def _stop(self, now: float, began: bool) -> int:
        if began and self.limit is not None and now + self.reserve > self.limit:
            return WALL
        if now - self._looked > LOOK_SECONDS:
            self._looked = now
            asked = os.path.lexists(self.stop_file) or (self.sweep_stop_file is not None and self.sweep_stop_file.asks)
            return FILE if asked else GO
        return GO

    def _due(self, step: int, now: float, began: bool) -> bool:
        if not began:
            return False
        if self.rules.every is not None:
            return step // self.rules.every > self._made // self.rules.every  # a multiple may be skipped
        return self.rules.minutes is not None and now - self._saved >= 60.0 * self.rules.minutes

    @property
    def reserve(self) -> float:
        """Return the wall time [s] that one more step and a checkpoint may need. Each of them is expected to take twice
        as long as before."""
        write = self._write if self._write >= 0.0 else self.state_bytes / FIRST_WRITE
        return RESERVE_SECONDS + 2.0 * (max(self._steps, default=0.0) + write)


@contextmanager
def watching(directory: Directory, rules: Checkpoint, options: Options) -> Iterator[Watch]:
    """Yield the object that watches a run or a curve for reasons to stop. Within the context it notes signals."""
    limit = limit_time(options.wall) if directory.slab.root else None
    with Signals().noted() as signals:
        yield Watch(directory.slab, rules, directory.stop_file, signals, limit, options.sweep_stop_file)


def limit_time(wall: float | None, environment: Mapping[str, str] = os.environ) -> float | None:
    """Return the time (of `time.monotonic`) by which a run must end: after `wall` seconds, or with its batch job.

    The end of a batch job is SLURM_JOB_END_TIME or PARCONTACT_END_TIME [s since 1970]. With PBS, it is PBS_WALLTIME
    after the start of this program, slightly later than the true end. An end before the start of this program belongs
    to another job and is ignored. The system's clock is read once, as it may be changed later.
    """
    now = time.monotonic()
    born, epoch = now - age(), now - time.time()
    limits = [] if wall is None else [born + wall]
    for name, start in (("PARCONTACT_END_TIME", epoch), ("SLURM_JOB_END_TIME", epoch), ("PBS_WALLTIME", born)):
        with suppress(KeyError, ValueError):
            end = start + float(environment[name])
            limits += [end] if end > born else []
    return min(limits, default=None)


def age() -> float:
    """Return the age of this process [s]."""
    try:
        ticks = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19])
        return max(time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK"), 0.0)
    except (OSError, ValueError, IndexError):
        return 0.0
