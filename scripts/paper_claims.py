#!/usr/bin/env python3
"""Set what the paper says of rough sliding (Sec. 3.1) beside what its jobs have found, one line of a table each.

    scripts/paper_claims.py --from out

It reads the sweeps of figures 9 and 10, with their theory. Run it with the Python of .venv.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from paper_panels import means

from parcontact.errors import InputError
from parcontact.job import Initial, load
from parcontact.parallel.mpi import MPI
from parcontact.parallel.slab import Slab
from parcontact.report import prediction
from parcontact.summary import sweep_table
from parcontact.theory.persson import GAMMA

JOB = Path(__file__).resolve().parents[1] / "jobs" / "paper" / "fig09_velocities.yaml"

SLIGHT = 3.2e5  # Pa: pressures up to here are low
FULL = 0.999  # contact area ratio from which on contact is full


def claims(out: Path) -> Iterator[tuple[str, str]]:
    """What the paper says in Sec. 3, and what the jobs have found."""
    speeds, pressures = (sweep_table.read(out / name / "sweep.csv") for name in ("fig09_velocities", "fig10_pressures"))
    by = {"fig. 9": (speeds, "history.1.velocity"), "fig. 10": (pressures, "history.1.pressure")}
    said = {
        "contact_area": "the theory's contact area is smaller, by less than 15 %",
        "mu_dyn": "the theory's mu_dyn is smaller, by around 30 %",
        "mu_max": "the theory's mu_max is smaller, by up to 50 % at high velocities",
    }
    for name, text in said.items():
        shares = []
        for figure, (rows, key) in by.items():
            share = 100 * (means(rows, key, f"theory_{name}")[1] / means(rows, key, name)[1] - 1)
            shares.append(f"{figure}: {share.min():+.0f} ... {share.max():+.0f} %")
        yield text, "; ".join(shares)
    x, highest, _ = means(speeds, "history.1.velocity", "mu_max")
    _, dynamic, _ = means(speeds, "history.1.velocity", "mu_dyn")
    theory = means(speeds, "history.1.velocity", "theory_mu_dyn")[1]
    where = f"{x[np.argmax(dynamic)]:g} m/s; theory: {x[np.argmax(theory)]:g} m/s"
    yield "the theory's gamma = 0.45 is slightly too low", _fitting_gammas(dynamic / theory, x)
    yield "steady friction is highest at 0.3 m/s in both", where
    yield "mu_max grows with V1 throughout", "yes" if np.all(np.diff(highest) > 0) else "no"
    below = highest[x < x[np.argmax(dynamic)]] / dynamic[x < x[np.argmax(dynamic)]]
    told = f"yes: mu_max/mu_dyn = {below.min():.2f}" if below.size and below.min() > 1 else "no"
    yield "there is a maximum also when V0 and V1 are below the velocity of highest friction", told
    p, dynamic, _ = means(pressures, "history.1.pressure", "mu_dyn")
    area, theory = (means(pressures, "history.1.pressure", name)[1] for name in ("contact_area", "theory_mu_dyn"))
    low = dynamic[p <= SLIGHT]
    yield "friction depends only slightly on low pressures", f"mu_dyn {low.min():.4f} ... {low.max():.4f} up to 0.3 MPa"
    full = area > FULL
    slope = np.polyfit(np.log(p[-2:]), np.log(dynamic[-2:]), 1)[0]
    yield "in full contact friction falls like 1/P", f"like P^{slope:.2f} between the two highest pressures"
    off = 100 * np.abs(theory[full] / dynamic[full] - 1)
    yield "in full contact both agree", f"to {off.max():.1f} %" if full.any() else "not reached"


def _fitting_gammas(ratios: np.ndarray, speeds: np.ndarray) -> str:
    """Of the gammas with which the theory would have friction larger by such ratios: friction is linear in gamma."""
    job = load(JOB, case=0)
    found = []
    for ratio, speed in zip(ratios, speeds, strict=True):
        state = {"state": "steady", "velocity": float(speed), "pressure": job.initial.pressure}
        stage = job.history[-1].model_copy(update={"velocity": (float(speed), 0.0)})
        steady = job.model_copy(update={"initial": Initial.model_validate(state), "history": (stage,)})
        slab = Slab(MPI.COMM_SELF, *job.grid.points)
        none, usual = (next(prediction.predict(steady, slab, gamma, "continuum")).friction for gamma in (0.0, GAMMA))
        found.append(GAMMA * (ratio * usual - none) / (usual - none))
    return f"mu_dyn would fit with gamma = {min(found):.2f} ... {max(found):.2f} (fig. 9)"


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="out", type=Path, default=Path("out"), metavar="DIR")
    try:
        for said, found in claims(parser.parse_args(argv).out):
            print(f"| {said} | {found} |")
    except InputError as error:
        print(f"{error}; run the job of the figure first", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
