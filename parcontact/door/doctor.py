"""`parcontact doctor`: checks of an installation.

The doctor describes the machine: its ranks, libraries and speed, and the files that a run writes and reads. It runs
small jobs and compares their results with exact solutions. A `Bench` runs these jobs and keeps the comparisons.
"""

import math
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import ArrayLike

from .. import capabilities, compiled
from ..errors import RunError
from ..files import recorder, run
from ..files.recorder import StepRow
from ..files.stopping import Options
from ..job import Job, load
from ..job.history import Timeline
from ..march import steady
from ..march.loop import March
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab
from ..physics import loops, prony
from ..theory import hertz, persson, wavy

if TYPE_CHECKING:
    from mpi4py import MPI

Json = dict[str, Any]
Watch = Callable[[March], None]


@dataclass(frozen=True)
class Finding:
    """A number that a check found, its exact value, and the largest absolute error that is allowed."""

    what: str
    found: float
    expected: float
    allowed: float

    @property
    def share(self) -> float:
        """Return the error divided by the allowed error; infinite for NaN."""
        error = abs(self.found - self.expected)
        if math.isnan(error):
            return math.inf
        return error / self.allowed if self.allowed > 0.0 else (math.inf if error else 0.0)

    @property
    def ok(self) -> bool:
        return self.share <= 1.0

    def __str__(self) -> str:
        if self.expected == 0.0:
            return f"{self.what} = {self.found:.2g} (0 ± {self.allowed:.1g})"
        return f"{self.what} = {self.found:.6g} ({self.expected:.6g} ± {self.allowed:.1g})"


class Bench:
    """Runs small jobs on the ranks of `comm` in one precision, and compares results with exact values.

    Of findings with the same `what` it keeps the one with the largest error in proportion to the allowed error.
    """

    def __init__(self, comm: "MPI.Intracomm", precision: str = "double") -> None:
        self.comm, self.precision = comm, precision
        self.findings: dict[str, Finding] = {}
        self.residual, self.iterations, self.failure = 0.0, 0, ""

    @property
    def wrong(self) -> list[str]:
        """Return the findings beyond their limits as texts."""
        return [*filter(None, [self.failure]), *(str(found) for found in self.findings.values() if not found.ok)]

    @property
    def nearest(self) -> str:
        """Return a text on the finding with the largest `share`."""
        return self.failure or str(max(self.findings.values(), key=lambda found: found.share))

    # -- running -------------------------------------------------------------------------------------------------------

    def begin(self, data: Json) -> March:
        """Return a march at the start of a job; collective. Unless the job says otherwise, its tolerance is 1e-10, and
        all branches of the material are kept as maps."""
        numerics = {"tolerance": 1e-10, "branch_error": 0.0, **data.get("numerics", {}), "precision": self.precision}
        job = Job.model_validate({**data, "numerics": numerics})
        march = steady.first(job, Slab(self.comm, *job.grid.points))
        self._note(march.row)
        return march

    def march(self, data: Json, *watches: Watch) -> tuple[March, list[StepRow]]:
        """Return a march at the end of a job, and the rows of all instants including the initial one; collective."""
        march = self.begin(data)
        job, rows = march.scene.job, [march.row]
        for step in Timeline.from_job(job):
            rows.append(march.advance(step))
            self._note(march.row)
            for watch in watches:
                watch(march)
        return march, rows

    def whole(self, march: March, name: str) -> Array:
        """Return a field of all ranks, shape (ny, nx), on every rank; collective."""
        return np.concatenate(march.scene.slab.from_all(march.field(name)))

    def amplitude(self, march: March) -> float:
        """Return the amplitude [Pa] of a pressure that is a single wave, longer than two cells; collective."""
        return float(np.sqrt(2.0) * np.std(self.whole(march, "pressure")))

    def _note(self, row: StepRow) -> None:
        self.residual = float(np.max((self.residual, row.certificate.worst)))  # NaN if one of them is NaN
        self.iterations = max(self.iterations, row.iterations)

    # -- expected values -----------------------------------------------------------------------------------------------

    def expect(self, what: str, found: float, expected: float, within: float, scale: float | None = None) -> None:
        """Record a result with an allowed error of `within` times `scale` (default: the exact value)."""
        allowed = within * (abs(float(expected)) if scale is None else scale)
        finding = Finding(what, float(found), float(expected), allowed)
        known = self.findings.get(what)
        if known is None or finding.share >= known.share:
            self.findings[what] = finding

    def expect_all(self, what: str, found: ArrayLike, expected: ArrayLike, within: float) -> None:
        """Record many results with an allowed error of `within` times the largest exact value."""
        found, expected = np.broadcast_arrays(np.asarray(found, float), np.asarray(expected, float))
        largest = float(np.abs(expected).max())
        for one, other in zip(found.ravel(), expected.ravel(), strict=True):
            self.expect(what, one, other, within, scale=largest)


# one branch and a spring: modulus 2.75 MPa at once and 0.275 MPa at long times, relaxation time 1 ms
PRONY = (0.275e6, [2.475e6], [1e-3])
GLASSY, RELAXATION = 2.75e6, 1e-3

# one wave: 0.25 mm long and 0.5 µm high, in full contact under 0.2 MPa
WAVELENGTH, HEIGHT, MEAN = 0.25e-3, 0.5e-6, 0.2e6
K = 2 * np.pi / WAVELENGTH

RADIUS = 1e-2  # radius of spheres [m]


def zener(modulus_inf: float, moduli: Sequence[float], times: Sequence[float]) -> Json:
    """Return a material with relaxing branches; an elastic material without `moduli`."""
    if not len(moduli):
        return {"model": "elastic", "shear_modulus": modulus_inf}
    branches = [{"modulus": m, "relaxation_time": t} for m, t in zip(moduli, times, strict=True)]
    return {"model": "zener", "modulus_inf": modulus_inf, "branches": branches}


def wave(
    history: Sequence[Json], waves: tuple[int, int] = (1, 0), points: tuple[int, int] = (8, 3), **job: Any
) -> Json:
    """Return a job of one wave on a square box; in stages without a load the contact is full."""
    loads = {"pressure", "force", "approach"}
    return {
        "grid": {"points": list(points), "size": WAVELENGTH},
        "surface": {"shape": "wave", "amplitude": HEIGHT, "waves": list(waves)},
        "material": zener(*PRONY),
        "history": [{**({} if loads & stage.keys() else {"pressure": MEAN}), **stage} for stage in history],
        **job,
    }


def crossed(history: Sequence[Json], points: int = 16, **job: Any) -> Json:
    """Return a job of two crossed waves, in partial contact at about 20 kPa, with mirror symmetry in x and y."""
    surface = [{"shape": "wave", "amplitude": a, "waves": w} for a, w in ((HEIGHT, [1, 0]), (0.6 * HEIGHT, [0, 1]))]
    return wave(history, points=(points, points), **{"surface": surface, **job})


def sphere(history: Sequence[Json], points: int = 32, size: float = 3e-3, **job: Any) -> Json:
    """Return a job of a sphere on a half space with free boundaries."""
    return {
        "grid": {"points": points, "size": size, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": RADIUS},
        "material": zener(*PRONY),
        "history": list(history),
        **job,
    }


PER_POINT = 1.2e-8  # time of an operator call per point on a machine of 2022 [s], for the share that is named
POINTS = 512  # tuning: points along each side of the contact that is timed
SLOW = 4.0  # tuning: time of an operator call above which a warning is given, over the usual time
SAME = 1e-6  # accuracy: limit on the difference of pressures, over the largest pressure
STEPS = 4  # tuning: steps of the run whose files are read back


def describe_machine(comm: "MPI.Intracomm") -> Iterator[str]:
    """Yield lines on ranks, libraries and times, and warnings; collective: all ranks must exhaust the iterator."""
    yield from recorder.machine_lines(comm)
    yield f"HDF5 {h5py.version.hdf5_version}"
    cores = len(os.sched_getaffinity(0))
    here = sum(name == os.uname().nodename for name in comm.allgather(os.uname().nodename))
    if here > cores:
        yield f"warning: {here} ranks share {cores} cores of this machine"
    bench = Bench(comm)
    loads = [{"pressure": 1e4}, {"pressure": 1.1e4}]
    _, rows = bench.march(crossed(loads, POINTS, material=zener(GLASSY, [], []), numerics={"tolerance": 1e-6}))
    seconds, usual = rows[-1].seconds / rows[-1].operator_calls, PER_POINT * POINTS**2 / comm.size
    yield f"{POINTS} x {POINTS} points: {1e3 * seconds:.3g} ms per operator call"
    if seconds > SLOW * usual:
        yield f"warning: this is slow, {1e3 * usual:.2g} ms is usual; do other programs run, or too many threads?"


def prepare_loops(comm: "MPI.Intracomm") -> str:
    """Run small jobs to compile loops which the checks do not use; return a line of text. Collective.

    The jobs slide steadily, slide in mixed precision, and adhere in periodic and free boxes. Then the function
    `compile_loops` of each effect is called.
    """
    began = time.perf_counter()
    touch = {"pressure": 3e4, "duration": 1e-3, "time_step": 5e-4}
    slide = {"pressure": 3e4, "velocity": 0.03, "distance": 3e-5, "cells_per_step": 1}
    road = {"shape": "rough", "hurst": 0.9, "rms_slope": 0.02, "seed": 1}  # its steady sliding needs every solver
    road |= {"long_wavelength": 2.5e-4, "short_wavelength": 6.25e-5}
    rough: Json = {"grid": {"points": 32, "size": 1e-3}, "surface": road, "numerics": {"tolerance": 5e-3}}
    steady, energy = {"state": "steady", "velocity": 0.03, "pressure": 3e4}, {"energy": True}
    Bench(comm).march(crossed([slide], **rough, initial=steady))
    Bench(comm).march(crossed([touch, slide], **rough, output=energy))
    Bench(comm, "mixed").march(crossed([touch, slide], **rough))
    sticking: Json = {"adhesion": {"work": 1e-3, "range": 1e-6}}
    for adhesion in ({}, sticking):
        Bench(comm).march(crossed([touch], **adhesion, output=energy, numerics=rough["numerics"]))
        Bench(comm).march(sphere([touch], **adhesion, output=energy, numerics=rough["numerics"]))
    direction = np.zeros((1, 1), np.float32)
    for image in (direction, direction.astype(np.float64)):  # of exact steps, which few solves need
        loops.dot(direction, image)
    for compile_loops in capabilities.offers("effect", "compile_loops"):
        compile_loops()
    place = compiled.directory("compiled")
    kept = f"kept in {place}" if place else "not kept, as there is no private cache directory"
    return f"compiled loops: ready after {time.perf_counter() - began:.2g} s, {kept}"


def find_broken_files(comm: "MPI.Intracomm", where: Path) -> str:
    """Run a small job in two parts in a directory, and compare the pressures in its file with those of a run in memory;
    return a message if they differ, else ''. Collective."""
    place = Path(comm.bcast(tempfile.mkdtemp(prefix="doctor-", dir=where) if comm.rank == 0 else None))
    try:
        stage = {"pressure": 1e4, "duration": 1e-3, "time_step": 1e-3 / STEPS}
        output = {"directory": str(place / "out"), "fields": ["pressure"], "every": 1}
        given = Job.model_validate(crossed([stage], output=output, numerics={"tolerance": 1e-6}))
        on_root(comm, lambda: (place / "job.yaml").write_text(given.resolved()))
        job = load(place / "job.yaml")
        slab = Slab(comm, *job.grid.points)
        for until in (0.5e-3, None):
            run.run_job(job, slab, Options(quiet=True, until=until))
        bench = Bench(comm)
        march, _ = bench.march(crossed([stage], numerics=job.numerics.model_dump()))
        expected = bench.whole(march, "pressure")
        with h5py.File(place / "out" / "fields.h5") as file:
            found = file["pressure"][-1]
        sound = np.allclose(found, expected, rtol=0.0, atol=SAME * expected.max())
        return (
            "" if comm.bcast(bool(sound)) else f"pressures in fields.h5 of a continued run are wrong; is {where} sound?"
        )
    finally:
        comm.Barrier()
        if comm.rank == 0:
            shutil.rmtree(place, ignore_errors=True)


ITERATIONS = 60  # tuning: limit on the iterations of a contact solve
RUBBER = zener(GLASSY, [], [])
WAVES = ((1, 0, 1.0), (2, 1, 0.5), (0, 2, 0.4), (1, -3, 0.3), (4, 3, 0.1), (-5, 4, 0.1))  # nx, ny, height/HEIGHT


@dataclass(frozen=True)
class Check:
    """A small calculation with an exact solution: `run` performs it on a bench, and records results there."""

    name: str
    expected: str
    run: Callable[[Bench], None]


def run_check(check: Check, bench: Bench) -> Bench:
    """Run a check on a bench, and return the bench; collective. The error of a failed solve becomes `bench.failure`."""
    try:
        check.run(bench)
    except RunError as error:
        bench.failure = str(error)
    return bench


def markdown(results: Iterable[tuple[Check, Bench]]) -> str:
    """Return the table of results in Markdown."""
    head = ("", "case", "expected", "result nearest to its limit [SI]", "residual", "iterations", "")
    lines: list[tuple[str, ...]] = [head]
    for number, (check, bench) in enumerate(results, start=1):
        cost = f"{bench.residual:.0e}", str(bench.iterations)
        verdict = "WRONG" if bench.wrong else "ok"
        lines.append((str(number), check.name, check.expected, bench.nearest, *cost, verdict))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    lines.insert(1, tuple("-" * width for width in widths))
    return "\n".join("| " + " | ".join(map(str.ljust, line, widths)) + " |" for line in lines)


def nearly_full(bench: Bench) -> None:
    """Check Westergaard's wave at 0.99, 1 and 1.01 of the load of full contact."""
    for share in (0.99, 1.0, 1.01):
        mean = share * float(wavy.full_contact_pressure(HEIGHT, WAVELENGTH, GLASSY))
        job = wave([{"pressure": mean}, {"pressure": mean}], points=(256, 1), material=RUBBER)
        march, rows = bench.march(job)
        x = np.arange(256) * WAVELENGTH / 256
        exact = wavy.pressure(x, mean, HEIGHT, WAVELENGTH, GLASSY)
        bench.expect_all("Westergaard", bench.whole(march, "pressure")[0], exact, 1e-9 if share > 1 else 5e-3)
        area = float(wavy.contact_fraction(mean, HEIGHT, WAVELENGTH, GLASSY))
        bench.expect("area", rows[-1].measures.contact_area, area, 2 / 256 if share <= 1 else 0.0, scale=1.0)
    bench.expect("iterations", bench.iterations, 0.0, ITERATIONS, scale=1.0)


def closed_by_load(bench: Bench) -> None:
    """Check sliding in full contact of many waves: forces in steady sliding and in time steps are sums over waves in
    closed form, and the steady friction agrees with Persson's theory for any gamma."""
    velocity, points = 0.3 * WAVELENGTH / RELAXATION, 16
    surface = [
        {"shape": "wave", "amplitude": share * HEIGHT, "waves": [x, y], "phase": 1.0 * x} for x, y, share in WAVES
    ]
    start = {"state": "steady", "velocity": velocity, "pressure": 1e6}
    stage = {"pressure": 1e6, "velocity": velocity, "distance": 5 * WAVELENGTH, "cells_per_step": 1}
    _, rows = bench.march(wave([stage], points=(points, points), surface=surface, initial=start))
    x, y, share = np.array(WAVES).T
    rings = persson.rings_of_surface(wavy.Waves((share * HEIGHT).astype(complex), K * x, K * y))
    omega = rings.waves.kx * velocity
    exact = prony.complex_modulus(omega, *PRONY)
    discrete = prony.discrete_modulus(omega, WAVELENGTH / points / velocity, *PRONY)
    for what, row, modulus in (("force", rows[0], exact), ("force of steps", rows[-1], discrete)):
        forces = wavy.traction(*rings.waves, modulus) * WAVELENGTH**2
        bench.expect_all(what, [row.measures.force_x, row.measures.force_y], forces, 1e-8)
        for gamma in (0.0, 1.0):
            friction = -row.measures.force_x / (1e6 * WAVELENGTH**2)
            expected = persson.friction_coefficient(1e6, rings, velocity, 0.0, modulus, gamma)
            bench.expect("friction", friction, float(expected), 1e-8)
    bench.expect("area", min(row.measures.contact_area for row in rows), 1.0, 0.0)


def retraction(bench: Bench) -> None:
    """Check a sphere pressed in and pulled back (Ting): contact ends while its approach is still positive."""
    depth, rise, steps = 5e-5, 1e-3, 25
    ramps = ((0.0, depth), (depth, 0.0))
    history = [{"approach": {"from": a, "to": b}, "duration": rise, "time_step": rise / steps} for a, b in ramps]
    _, rows = bench.march(sphere(history, size=2e-3, numerics={"tolerance": 1e-6}))
    t = np.array([row.time for row in rows])
    force = np.array([row.measures.pressure for row in rows]) * 2e-3**2
    exact = hertz.triangle_force(t, depth, rise, RADIUS, *PRONY)
    bench.expect_all("force", force, exact, 1e-2)
    lift_off = hertz.triangle_lift_off_time(rise, *PRONY)
    bench.expect("lift-off", t[np.flatnonzero(force)[-1]], lift_off, rise / steps / lift_off)
    bench.expect("force after", force[t > lift_off].max(), 0.0, 0.0)
    bench.expect("area after", max(row.measures.contact_area for row in rows if row.time > lift_off), 0.0, 0.0)


CHECKS = (
    Check("0.99, 1 and 1.01 of full contact", "Westergaard; 60 iterations", nearly_full),
    Check("sphere pulled back", "Ting: lift-off before approach 0", retraction),
    Check("full contact of many waves, sliding", "sum over the waves", closed_by_load),
)
