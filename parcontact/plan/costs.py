"""Costs of a job by a trial: time and memory, scaled if the trial was on a coarser grid."""

import math
import os
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryFile

from ..history.timeline import Timeline
from ..job import Job
from ..scene import choices
from . import memory
from .sample import Sample

TRIED_BYTES = 32 << 20  # tuning: size of the file that is written to measure the rate [bytes]
SLOW_WRITE = 100e6  # tuning: writing rate that is assumed if it cannot be measured [bytes/s]


@dataclass(frozen=True)
class Costs:
    """Costs of a job: a `sample` with the steps of this job, perhaps tried on a coarser grid, and the writing rate
    [bytes/s]."""

    job: Job
    sample: Sample
    write_rate: float

    @property
    def held(self) -> float:
        """Return the largest memory of a rank in maps [bytes]: in steps, or in the first contact or steady state on
        nested grids, as measured by the trial."""
        ranks = self.sample.ranks
        known = (
            max(memory.total_bytes(self.job, ranks), memory.steady_start(self.job, ranks)) if self.job.history else 0
        )
        return max(float(known), self.sample.held * _points(self.job) / _points(self.sample.job))

    @property
    def resident(self) -> float:
        """Return the resident memory of a rank [bytes]."""
        return self.held + self.sample.resident + self.instant_bytes // self.sample.ranks

    @property
    def finer(self) -> float:
        """Return the ratio of the work N log N on the grid of the job to the work on the grid of the sample."""
        mine, tried = _points(self.job), _points(self.sample.job)
        return mine * math.log(mine + 1) / (tried * math.log(tried + 1))

    @property
    def step(self) -> float:
        """Return the mean time of a step of the job [s]."""
        return self.sample.total("seconds") * self.finer / max(self.sample.steps, 1)

    @property
    def marching(self) -> float:
        """Return the time of all steps, or steady states [s]."""
        return self.sample.steps * self.step

    @property
    def building(self) -> float:
        """Return the time in which the scene is set up [s]."""
        return self.sample.building * self.finer

    @property
    def writing(self) -> float:
        """Return the time to write all checkpoints and fields [s]."""
        if not self.job.history:
            return 0.0
        rules, count = self.job.checkpoint, self.sample.steps
        if rules.every is not None:
            checkpoints = -(-count // rules.every)
        else:
            checkpoints = int(self.marching / (60.0 * (rules.minutes or math.inf))) + 1
        return (checkpoints * memory.saved(self.job) + self.instants * self.instant_bytes) / self.write_rate

    @property
    def case(self) -> float:
        """Return the time of a run without the start of the program [s]."""
        return self.building + self.marching + self.writing

    @property
    def whole(self) -> float:
        """Return the time of the whole run [s]."""
        return self.sample.starting + self.case

    @property
    def instants(self) -> int:
        """Return the number of instants at which fields are saved."""
        saved = self.job.history and choices(self.job).fields.on
        return -(-self.sample.steps // self.job.output.every) if saved else 0

    @property
    def instant_bytes(self) -> int:
        return len(self.job.output.maps) * _points(self.job) * 8


def costs_of(job: Job, sample: Sample, write_rate: float) -> Costs:
    """Return the costs of a job from a sample, whose grid may be coarser and whose stages may have fewer steps."""
    if job.grid == sample.job.grid or not job.history:
        return Costs(job, sample, write_rate)
    spans = Timeline.from_job(job).spans
    stages = (replace(stage, steps=span.jumps + span.count) for stage, span in zip(sample.stages, spans, strict=True))
    return Costs(job, replace(sample, stages=tuple(stages)), write_rate)


def _points(job: Job) -> int:
    return job.grid.nx * job.grid.ny


def measure_write_rate(directory: Path) -> float:
    """Return the writing rate [bytes/s] in the directory or its nearest existing parent, by a temporary file."""
    place = next(path for path in (directory.absolute(), *directory.absolute().parents) if path.is_dir())
    with suppress(OSError), TemporaryFile(dir=place) as file:
        data = os.urandom(TRIED_BYTES)
        began = time.perf_counter()
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
        return TRIED_BYTES / (time.perf_counter() - began)
    return SLOW_WRITE
