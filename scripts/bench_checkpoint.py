"""What a checkpoint costs, over plain writing of the same bytes: `.venv/bin/python scripts/bench_checkpoint.py`.

Starts itself under mpirun. Each round writes the state of a run twice, one way after the other: every rank its bytes by
`numpy.tofile` into a file of its own, and all ranks together a checkpoint; both wait until the disk has them. Compared
are the fastest rounds, which others who use the machine disturb least; the median of the ratios stands beside them.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

LIMIT = 1.5  # a checkpoint over plain writing
SHARE = 0.02  # of the run time, at the default interval


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=2048, help="along x and y")
    parser.add_argument("--branches", type=int, default=12)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--where", type=Path, help="a directory on the disk in question")
    parser.add_argument("--in-turn", action="store_true", help="without MPI-IO")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def measure(chosen: argparse.Namespace) -> bool:
    import numpy as np
    from mpi4py import MPI

    from parcontact.job.sections.settings import Checkpoint
    from parcontact.parallel.slab import Slab
    from parcontact.physics.entries import Entry
    from parcontact.storage import checkpoint
    from parcontact.storage.checkpoint import Facts
    from parcontact.storage.provenance import Link, Provenance

    comm = MPI.COMM_WORLD
    slab = Slab(comm, chosen.points, chosen.points)
    where = Path(comm.bcast(tempfile.mkdtemp(dir=chosen.where) if slab.root else None))
    names = ["contact/pressure", "contact/earlier pressure", "material/displacement"]
    names += [f"material/branch {k}" for k in range(chosen.branches)]
    rng = np.random.default_rng(comm.rank)
    entries = {name: Entry(rng.random(slab.shape)) for name in names}
    facts = Facts({}, Provenance((Link("", comm.size),)), step=1)

    def plain() -> None:
        with (where / f"rank{comm.rank}").open("wb") as file:
            for entry in entries.values():
                np.asarray(entry.value).tofile(file)
            file.flush()
            os.fsync(file.fileno())

    def whole() -> None:
        checkpoint.write(where / "step-1.h5", slab, facts, entries, chosen.in_turn)

    def seconds(act: Callable[[], None]) -> float:
        for path in where.iterdir() if slab.root else ():
            path.unlink()
        comm.Barrier()
        began = time.perf_counter()
        act()
        comm.Barrier()
        return time.perf_counter() - began

    seconds(plain), seconds(whole)
    rounds = [(seconds(plain), seconds(whole)) for _ in range(chosen.rounds)]
    if slab.root:
        for path in where.iterdir():
            path.unlink()
        where.rmdir()
    size = len(names) * slab.points * 8 / 1e6
    bare, ours = (min(times) for times in zip(*rounds, strict=True))
    interval = 60.0 * (Checkpoint.model_validate({}).minutes or 0.0)
    good = ours <= LIMIT * bare and ours <= SHARE * interval
    if slab.root:
        how = "in turn" if chosen.in_turn else "by MPI-IO"
        print(f"{size:.0f} MB on {comm.size} ranks, {how}, {chosen.rounds} rounds")
        print(f"numpy.tofile {bare:.3f} s, checkpoint {ours:.3f} s")
        median = statistics.median(b / a for a, b in rounds)
        print(f"ratio {ours / bare:.2f} (median of rounds {median:.2f}; at most {LIMIT})")
        print(f"share of the run time, every {interval:.0f} s: {ours / interval:.2%} (at most {SHARE:.0%})")
        print("good" if good else "NOT GOOD")
    return good


def main() -> int:
    chosen = arguments()
    if chosen.inside:
        return 0 if measure(chosen) else 1
    mpirun = Path(sys.executable).with_name("mpirun")
    return subprocess.call([mpirun, "-n", str(chosen.ranks), sys.executable, *sys.argv, "--inside"])


if __name__ == "__main__":
    sys.exit(main())
