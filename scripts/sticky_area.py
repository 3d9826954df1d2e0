"""Contact area over load of a rough surface with adhesion and without, beside what is published without.

    .venv/bin/python scripts/sticky_area.py [--points 256] [--to out/sticky_area.png]

The job is jobs/adhesion/challenge.yaml. Without adhesion the area is kappa p/(E* s) at small loads, with the rms slope
s and kappa = 2 to 2.2 (S. Hyun, L. Pei, J.-F. Molinari, M. O. Robbins, Phys. Rev. E 70 (2004) 026117; N. Prodanov,
W. B. Dapp, M. H. Mueser, Tribol. Lett. 53 (2014) 433); Persson's theory has erf(sqrt(2) p/(E* s)).
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mpi4py import MPI
from runs import ROOT
from scipy.special import erf

import parcontact as pc
from parcontact.plotting import style

LEAST, MOST = 1e-3, 0.15  # of contact areas
SHOWN = (0.001, 0.01, 0.05, 0.1, 0.15)


def curve(job: dict[str, Any]) -> tuple[Any, Any]:
    """Loads over E* and slope, and corrected contact areas."""
    rows = [row for row in pc.Simulation(job, comm=MPI.COMM_SELF).steps() if row.contact_area_corrected > 0.0]
    unit = 4.0 * float(job["material"]["shear_modulus"]) * float(job["surface"]["rms_slope"])
    return np.array([row.pressure for row in rows]) / unit, np.array([row.contact_area_corrected for row in rows])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=256)
    parser.add_argument("--to", type=Path, default=Path("out/sticky_area.png"))
    asked = parser.parse_args()
    job = yaml.safe_load((ROOT / "jobs" / "adhesion" / "challenge.yaml").read_text())
    job["grid"]["points"] = asked.points
    job.pop("output")
    curves = {"with adhesion": curve(job)}
    job.pop("adhesion")
    curves["without"] = curve(job)
    for name, (load, area) in curves.items():
        told = [f"{np.interp(wanted, area, load):.2e}" for wanted in SHOWN]
        print(f"{name}: load over E* and slope at {', '.join(f'{100 * one:g} %' for one in SHOWN)}: {', '.join(told)}")
    asked.to.parent.mkdir(parents=True, exist_ok=True)
    with style.drawing():
        style.save(style.figure_of("", [[lambda axes: draw(axes, curves)]]), asked.to)
    print(f"picture: {asked.to}")


def draw(axes: Any, curves: dict[str, tuple[Any, Any]]) -> None:
    for number, (name, (load, area)) in enumerate(curves.items()):
        there = (area > LEAST) & (area < MOST)
        axes.plot(load[there], 100 * area[there], marker=".", label=name, **style.line(number))
    load = np.geomspace(4e-4, 0.1)
    axes.fill_between(load, 200 * load, 220 * load, color=style.GREY, alpha=0.4, label="published, without")
    axes.plot(load, 100 * erf(np.sqrt(2) * load), label="Persson's theory", color=style.GREY, linestyle=":")
    axes.set(xscale="log", yscale="log", xlabel="mean pressure / (E* rms slope)", ylabel="contact area [%]")
    axes.set(ylim=(100 * LEAST, 100 * MOST), xlim=(1e-5, 0.1))
    axes.legend()


if __name__ == "__main__":
    main()
