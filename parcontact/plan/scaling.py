"""From a job tried on some ranks to its time on others: work is divided, calls are not, messages are added.

A step on P ranks takes

    T(P) = (T_work crowding(P) / P) + T_calls + n_fft T_transpose(P) + n_sum T_sum(P),

with T_work + T_calls the time of a step on one rank, T_calls what each operator call costs on the smallest grid.
Messages follow the alpha-beta model (R. W. Hockney, Parallel Computing 20 (1994) 389): alpha + bytes/beta each. In a
transpose a rank sends P - 1 messages, `bytes` in all; the share for ranks on other nodes leaves through the node's
network, which all ranks of a node use at once. What is sent is also copied out of the map and into the next, at the
rate of memory. A sum over ranks takes ceil(log2 P) messages.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ..job import Job
from . import memory
from .sample import Sample

SUMS_PER_STEP = 1  # that a run makes besides those of its march: whether to stop


@dataclass(frozen=True)
class Machine:
    """Nodes of `cores` ranks, on each of which `crowding` times the time is needed when all of them work.

    `per_call` [s] of an operator call that no rank saves; `latency` [s] of a message and `bandwidth` [byte/s] of the
    network of a node, `near_latency` of a message within a node; `copy_rate` [byte/s] of memory.
    """

    cores: int
    crowding: float
    per_call: float
    copy_rate: float
    latency: float = 2e-6
    bandwidth: float = 12.5e9
    near_latency: float = 5e-7

    def slowed(self, ranks: int) -> float:
        """The factor by which ranks that share a node slow each other down; linear in how full it is."""
        if self.cores == 1:
            return 1.0
        return 1.0 + (self.crowding - 1.0) * (min(ranks, self.cores) - 1) / (self.cores - 1)

    def transpose(self, sent: int, ranks: int) -> float:
        """Seconds of an exchange in which a rank sends so many bytes in all."""
        if ranks == 1:
            return 0.0
        near = min(self.cores, ranks) - 1
        far = ranks - 1 - near
        leaving = sent * far / (ranks - 1) * min(self.cores, ranks)
        copies = 3 * sent * self.slowed(ranks) / self.copy_rate
        return near * self.near_latency + far * self.latency + leaving / self.bandwidth + copies

    def sum(self, ranks: int) -> float:
        """Seconds of a sum over all ranks."""
        return math.ceil(math.log2(ranks)) * (self.near_latency if ranks <= self.cores else self.latency)


@dataclass(frozen=True)
class Scaling:
    """The time of a job's step on any number of ranks, from samples of it on some, be it on a coarser grid."""

    job: Job
    samples: tuple[Sample, ...]
    machine: Machine

    @classmethod
    def of(cls, job: Job, samples: Iterable[Sample], machine: Machine) -> "Scaling":
        """For a job, from what was seen of it."""
        return cls(job, tuple(sample.of(job) for sample in samples), machine)

    def sample(self, ranks: int) -> Sample:
        """The one to go by: on as many ranks, or the most that are fewer."""
        fewer = [sample for sample in self.samples if sample.ranks <= ranks]
        return max(fewer, key=lambda sample: sample.ranks) if fewer else self.samples[0]

    @property
    def steps(self) -> int:
        """Of the job."""
        return self.samples[0].steps

    def step(self, ranks: int) -> float:
        """Seconds of a step, on average over the job.

        Ranks change nothing in how many calls a step has: where one number of them had the time for more steps than
        another, the calls of these count for both.
        """
        sample = self.sample(ranks)
        calls = self.machine.per_call * _per_step(sample, "operator")
        seen = _per_step(sample, "seconds") - self._messages(sample.job, sample, sample.ranks) - calls
        shared = max(0.0, seen) * self._finer(sample) * self._share(ranks) / self._share(sample.ranks)
        return (shared + calls) * self._more_calls(sample) + self.messages(ranks)

    def _more_calls(self, sample: Sample) -> float:
        """Operator calls of a step where most steps were tried, over those of another sample."""
        most = max(self.samples, key=lambda sample: sample.tried)
        calls = _per_step(sample, "operator")
        return _per_step(most, "operator") / calls if calls > 0.0 else 1.0

    def held(self, ranks: int) -> float:
        """Bytes that a rank holds in maps at most, in proportion to its points."""
        sample = self.sample(ranks)
        points, tried = (job.grid.nx * job.grid.ny for job in (self.job, sample.job))
        return sample.held * points / tried * sample.ranks / ranks

    def messages(self, ranks: int) -> float:
        """Seconds of a step in which data moves between ranks."""
        sample = self.sample(ranks)
        return self._messages(self.job, sample, ranks) * self._more_calls(sample)

    def building(self, ranks: int) -> float:
        """Seconds in which the scene is made."""
        sample = self.sample(ranks)
        return sample.building * self._finer(sample) * self._share(ranks) / self._share(sample.ranks)

    def efficiency(self, ranks: int) -> float:
        """Time on one rank over that of all ranks together."""
        return self.step(1) / (ranks * self.step(ranks))

    @property
    def end(self) -> int:
        """The most ranks (a power of two, no more than rows) that work for at least half of their time."""
        ranks = 1
        while 2 * ranks <= self.job.grid.ny and self.efficiency(2 * ranks) >= 0.5:
            ranks *= 2
        return ranks

    def _finer(self, sample: Sample) -> float:
        """How much more work the grid of the job is than that of the sample."""
        points, tried = (job.grid.nx * job.grid.ny for job in (self.job, sample.job))
        return points * math.log(points + 1) / (tried * math.log(tried + 1))

    def _share(self, ranks: int) -> float:
        return self.machine.slowed(ranks) / ranks

    def _messages(self, job: Job, sample: Sample, ranks: int) -> float:
        """On the grid of some job; counts are those of the sample's."""
        sent = {holding.what: holding.sent for holding in memory.holdings(job, ranks) if holding.transform}
        exchanges = sum(
            _per_step(sample, holding.transform)
            * self.machine.transpose(sent.get(holding.what, sent[memory.TRANSFORMS]), ranks)
            for holding in memory.holdings(sample.job)
            if holding.transform
        )
        return exchanges + (_per_step(sample, "allreduce") + SUMS_PER_STEP) * self.machine.sum(ranks)


def _per_step(sample: Sample, name: str) -> float:
    return sample.total(name) / max(sample.steps, 1)
