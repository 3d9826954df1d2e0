"""Plans against runs: five different jobs on 1 and 2 ranks, memory and time, predicted and measured.

    .venv/bin/python scripts/check_plan.py [--coarser 1] [name ...]

Each job is planned as a user would (`parcontact plan --ranks 1,2`), then run on 1 and on 2 ranks. Memory is what root
holds in maps (`map bytes at most` in run.log) and the largest resident memory of a rank, each to 10 %; time is that of
the whole command, to 30 %. `--coarser 4` takes a quarter of the points, and waves as much longer. Takes two to three
minutes on two idle cores; on a busy machine the times say little.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

BIN = Path(sys.executable).parent
MEMORY, TIME = 0.10, 0.30
SECONDS = 4  # for which a job is tried

ROUGH = "{shape: rough, hurst: 0.8, long_wavelength: 2.5e-4, short_wavelength: SHORT, rms_slope: 0.02, seed: 1}"
TYRE = "{include: synthetic_tyre}"
SLS = "{model: zener, modulus_inf: 0.275e6, branches: [{modulus: 2.475e6, relaxation_time: 1.0e-3}]}"
ELASTIC = "{model: elastic, shear_modulus: 1.0e6}"
JOBS = {
    "elastic, eight loads": f"""
grid: {{points: 1024, size: 1.0e-3}}
surface: {ROUGH.replace("SHORT", "1.5625e-5")}
material: {ELASTIC}
history: [{", ".join(f"{{pressure: {p}}}" for p in (1e3, 2e3, 3e3, 5e3, 7e3, 1e4, 1.4e4, 2e4))}]
output: {{fields: [pressure, gap]}}
""",
    "twelve branches, press and slide": f"""
grid: {{points: 512, size: 1.0e-3}}
surface: {ROUGH.replace("SHORT", "3.125e-5")}
material: {TYRE}
history:
  - {{name: press, pressure: 1.0e5, duration: 1.0e-3, time_step: {{first: 1.0e-7, growth: 1.2}}}}
  - {{name: slide, pressure: 1.0e5, velocity: 0.3, distance: 3.0e-4, cells_per_step: 1}}
checkpoint: {{every: 100}}
""",
    "sphere that slides, energies": f"""
grid: {{points: 256, size: 1.0e-2, boundary: free}}
surface: {{shape: sphere, radius: 1.0e-2, center: [3.0e-3, 5.0e-3]}}
material: {SLS}
history: [{{force: 0.15, velocity: 0.046765, duration: 2.4e-2, time_step: 8.0e-5}}]
numerics: {{tolerance: 1.0e-6}}
output: {{energy: true}}
""",
    "mixed precision, elastic sliding": f"""
grid: {{points: 1024, size: 1.0e-3}}
surface: {ROUGH.replace("SHORT", "3.125e-5")}
material: {ELASTIC}
history: [{{pressure: 5.0e3, velocity: 0.3, distance: 6.0e-5, cells_per_step: 1}}]
numerics: {{precision: mixed}}
output: {{fields: [pressure], every: 20}}
""",
    "oblique sliding of a rubber": f"""
grid: {{points: 384, size: 1.0e-3}}
surface: {ROUGH.replace("SHORT", "6.25e-5")}
material: {SLS}
history: [{{pressure: 1.0e4, velocity: [0.02, 0.01], distance: 5.0e-4, time_step: 1.0e-4}}]
""",
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--coarser", type=int, default=1)
    parser.add_argument("names", nargs="*")
    chosen = parser.parse_args()
    wrong = 0
    print(f"{'job':34}{'ranks':>6}{'maps [MB]':>26}{'resident [MB]':>24}{'time [s]':>24}")
    print(f"{'':40}{'planned    held':>19}{'':7}{'planned    seen':>17}{'':7}{'planned    took':>17}")
    for name in chosen.names or JOBS:
        with TemporaryDirectory() as directory:
            path = Path(directory, "job.yaml")
            path.write_text(coarsened(JOBS[name], chosen.coarser))
            planned = plan(path)
            for ranks in (1, 2):
                pairs = list(zip(planned[ranks], run(path, ranks), (MEMORY, MEMORY, TIME), strict=True))
                wrong += sum(abs(before / after - 1.0) > most for before, after, most in pairs)
                text = "".join(f"{before:10.4g}{after:8.4g}{before / after - 1.0:+6.0%}" for before, after, _ in pairs)
                print(f"{name:34}{ranks:6d}  {text}", flush=True)
    print(f"memory within 10 % and time within 30 %: {f'NO, {wrong} are not' if wrong else 'yes'}")
    return 1 if wrong else 0


def coarsened(text: str, times: int) -> str:
    """A job on a grid so many times coarser."""
    text = re.sub(r"points: (\d+)", lambda found: f"points: {int(found[1]) // times}", text)
    return re.sub(r"short_wavelength: (\S+),", lambda found: f"short_wavelength: {float(found[1]) * times!r},", text)


def plan(path: Path) -> dict[int, tuple[float, float, float]]:
    """MB of maps, MB of memory and seconds by number of ranks."""
    words = [BIN / "parcontact", "plan", path, "--ranks", "1,2", "--seconds", str(SECONDS)]
    said = subprocess.run(words, cwd=path.parent, env=environment(), capture_output=True, text=True, check=True).stdout
    rows = re.findall(r"^ +(\d+) +([\d.]+) +([\d.]+) .* (\S+) s$", said, re.MULTILINE)
    return {int(ranks): (float(held), float(resident), float(seconds)) for ranks, held, resident, seconds in rows}


def run(path: Path, ranks: int) -> tuple[float, float, float]:
    """MB of maps on root, the largest resident memory of a rank [MB], seconds."""
    command = [] if ranks == 1 else [BIN / "mpirun", "-n", str(ranks)]
    words = [str(word) for word in (*command, BIN / "parcontact", path, "--out", f"out{ranks}", "--quiet")]
    began = time.perf_counter()
    process = subprocess.Popen(words, cwd=path.parent, env=environment())
    _, status, usage = os.wait4(process.pid, 0)
    took = time.perf_counter() - began
    if status:
        raise SystemExit(f"{' '.join(words)} failed")
    log = (path.parent / f"out{ranks}" / "run.log").read_text()
    (held,) = re.findall(r"map bytes at most (\d+)", log)
    return int(held) / 1e6, usage.ru_maxrss * 1024 / 1e6, took


def environment() -> dict[str, str]:
    return {**os.environ, "OMP_NUM_THREADS": "1"}


if __name__ == "__main__":
    sys.exit(main())
