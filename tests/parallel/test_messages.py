"""Messages of ranks: rows go to those that want them, only transforms send from all to all."""

from collections import Counter
from typing import Any

import numpy as np
import pytest
from counting import PART, PRESS, RUBBER, job
from marched_jobs import begun
from mpi4py import MPI

from parcontact.march.loop import run_steps
from parcontact.parallel import regrid
from parcontact.parallel.regrid import pyramid_steps
from parcontact.parallel.slab import Slab


class Counted:
    """A communicator that counts calls by name."""

    def __init__(self, comm: MPI.Intracomm) -> None:
        self.comm, self.size, self.rank, self.calls = comm, comm.size, comm.rank, Counter[str]()

    def __getattr__(self, name: str) -> Any:
        self.calls[name] += 1
        return getattr(self.comm, name)


class Pretended:
    """One of several ranks that are not there; it notes the bytes of each message to and from the others."""

    def __init__(self, size: int, rank: int) -> None:
        self.size, self.rank = size, rank
        self.sent, self.got = list[tuple[int, int, int]](), list[tuple[int, int, int]]()

    def Isend(self, message: list[Any], rank: int) -> MPI.Request:
        self.sent.append((self.rank, rank, message[0].nbytes))
        return MPI.REQUEST_NULL

    def Irecv(self, message: list[Any], rank: int) -> MPI.Request:
        self.got.append((rank, self.rank, message[0].nbytes))
        return MPI.REQUEST_NULL


def exchanges(slab: Any) -> int:
    """Make each kind of exchange between neighbours, on all grids of cells; return how many."""
    field = np.zeros(slab.shape)
    regrid.around(slab, field, 4, True)
    regrid.before_first(slab, field, True)
    steps = [step for step in pyramid_steps(slab) if step.coarse.comm.size == slab.comm.size > 1]
    for step in steps:
        step.adjacent_points(np.zeros(step.fine.shape), 0, -1)
        step.adjacent_cells(np.zeros(step.coarse.shape), 0, -1)
    return 2 + 2 * len(steps)


@pytest.mark.parametrize("ranks", [2, 4, 8])
def test_messages_go_to_neighbours(ranks: int) -> None:
    """Each exchange sends at most two messages of a rank, one to each side; others wait for just those."""
    sent, got = [], []
    for rank in range(ranks):
        comm: Any = Pretended(ranks, rank)
        count = exchanges(Slab(comm, 64, 512))
        assert 0 < len(comm.sent) <= 2 * count
        sent += comm.sent
        got += comm.got
    assert sorted(sent) == sorted(got)


def test_a_thousand_ranks_cost_what_a_few_do() -> None:
    """Kept exchanges make no step of Python for ranks that they send nothing to."""
    comm: Any = Pretended(1024, 500)
    slab = Slab(comm, 8, 4096)
    field = np.zeros(slab.shape)
    regrid.around(slab, field, 4, True)
    (kept,) = slab.exchanges.values()
    assert kept.partners == 4
    regrid.around(slab, field, 4, True)
    assert list(slab.exchanges.values()) == [kept]
    assert len(comm.sent) == len(comm.got) == 4


@pytest.mark.mpi(4)
def test_all_to_alls_are_those_of_transforms(communicators: list[MPI.Intracomm]) -> None:
    """In a run that presses and slides: one for each transform, one gathering for each sum, and messages as counted."""
    for comm in communicators:
        counted: Any = Counted(comm)
        march = begun(job(material=RUBBER, history=[PRESS, PART]), counted)
        before, tally = counted.calls.copy(), march.scene.slab.tally.copy()
        run_steps(march, [])
        calls, done = counted.calls - before, march.scene.slab.tally.since(tally)
        several = comm.size > 1
        assert calls["Alltoallv"] == several * done["fft"]
        assert calls["Allgather"] == several * done["allreduce"]
        assert calls["Isend"] == done.get("messages", 0)
        assert (calls["Isend"] > 0) == several
        assert not calls["alltoall"]
