"""How far the chain of jobs/road is from the truth: python jobs/road/compare.py (after the commands of its README).

Friction without the interface, at the reference temperature: with the true rubber on the true road, with the fitted one
there, with the true one on the treated road. And what branches cost: fits of several errors, and CPU time per step.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import parcontact as pc
from parcontact.rubber import compound

HERE = Path(__file__).parent
REFERENCE = 20.0
VELOCITIES = np.geomspace(1e-3, 1.0, 7)  # [m/s]
PRESSURE = 5.0e5  # [Pa]
TRUE_RUBBER = {"include": str(HERE / "truth" / "compound.yaml")}
TRUE_ROAD = {"grid": {"points": 256, "size": 2.0e-3}}
TRUE_ROAD |= {"surface": {"shape": "file", "path": str(HERE / "truth" / "road.npy")}}
ERRORS = (0.005, 0.02, 0.05, 0.1, 0.2)  # of fits
STEPS = 40  # of the slide whose time is taken


def job(**changes: Any) -> dict[str, Any]:
    """The job without its interface, at one temperature, with other sections; its files are those of this directory."""
    data = yaml.safe_load((HERE / "road.yaml").read_text())
    del data["interface"], data["output"], data["steady"]["temperatures"]
    data["surface"]["path"] = str(HERE / data["surface"]["path"])
    data["material"] = {"include": str(HERE / "materials" / "compound.yaml")}
    return {**data, **changes}


def friction(**changes: Any) -> np.ndarray:
    return np.asarray(pc.steady(job(**changes), VELOCITIES, [PRESSURE]).friction)


def main() -> None:
    truth = friction(material=TRUE_RUBBER, **TRUE_ROAD)
    rubber, road = friction(**TRUE_ROAD), friction(material=TRUE_RUBBER)
    print("| velocity [m/s] | true | fitted rubber | off by | treated road | off by |\n|--|--|--|--|--|--|")
    for v, mu, a, b in zip(VELOCITIES, truth, rubber, road, strict=True):
        print(f"| {v:.3g} | {mu:.4f} | {a:.4f} | {a / mu - 1:+.1%} | {b:.4f} | {b / mu - 1:+.1%} |")
    print("\n| error asked for | branches | rms error of G* | CPU time per step [ms] |\n|--|--|--|--|")
    for error in ERRORS:
        branches, off, seconds = cost(error)
        print(f"| {error:.1%} | {branches} | {off:.2%} | {1e3 * seconds:.3g} |")


def cost(error: float) -> tuple[int, float, float]:
    """Branches of a fit, its error against the truth, and seconds of a step that slides."""
    path = HERE / "measured" / "compound.csv"
    found = compound.fitted(path, 0.5, REFERENCE, "wlf", error).material()
    omega = np.geomspace(1e-3, 1e7, 200)
    true, own = (pc.material(one).complex_modulus(omega) for one in (TRUE_RUBBER, found))
    run = pc.Simulation(job(material=found))
    times = []
    for _ in run.steps():
        times.append(time.process_time())
        if len(times) > STEPS + 10:
            break
    return (
        len(found["branches"]),
        float(np.sqrt(np.mean(np.abs(own / true - 1) ** 2))),
        float(np.median(np.diff(times))),
    )


if __name__ == "__main__":
    main()
