"""`parcontact study`: errors and costs of settings, from a sweep over meshes, steps and integrators.

A study runs all combinations of its meshes, cells per step and integrators. For each integrator it also refines the
mesh alone: all meshes then have the time steps of the finest mesh. A rough surface of one seed has the same waves on
every mesh.

Stages that choose their steps do so in every case. But if the study lists cells per step, sliding stages have these
steps.

Richardson extrapolation gives the limit of values on finer and finer meshes, its order and its uncertainty.

For values `f(h) = f* + c h^p` at three sizes the order p follows from the ratio of their differences, and

f* = f1 + (f1 - f2)/((h2/h1)^p - 1)

with f1 at the finest size (paper, Eq. 14, with p = 1.4; I. B. Celik et al., J. Fluids Eng. 130 (2008) 078001 if h3/h2
differs from h2/h1). The uncertainty is the change of the limit if the order changes by DOUBT or, with four sizes, if
the finest size is left out, whichever is larger. The uncertainty is at least LEAST_DOUBT of the last difference.

Results of a study are limits, errors of all cases, the best settings, and sentences about them. A picture shows the
errors against the refinement of mesh and time step (as Fig. 6 of the paper), and against the computing time.
"""

import itertools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from ..columns import STUDY, names_of
from ..errors import BAD_INPUT, FAILED, STOPPED_EARLY, InputError
from ..files import files, outputs, run, sweep, tables
from ..files.outputs import Directory
from ..files.stopping import Options
from ..job import AUTO, Case, GeometricStep, Job, Stage
from ..job.advice import one_cell
from ..job.listing import plain_job
from ..job.reading import CASES
from ..parallel.root import on_root
from ..parallel.slab import Array, Groups, Slab
from ..printed import per_cent, with_error
from ..results import style
from ..results.panels import Axis, Line, Panel, Shade, picture
from ..results.results import Results
from .memory import warm_up

MakeJob = Callable[[Sequence[str]], Job]  # returns the job changed by overrides


@dataclass(frozen=True)
class Settings:
    """The settings of a case: points along x, integrator, and the number of cells of this mesh that the surface slides
    in a step; None if stages choose their steps, or if no step is given."""

    mesh: int
    cells_per_step: float | None
    integrator: str

    @property
    def time_step(self) -> float:
        """Return the distance slid in a step, in lengths of the box. Chosen steps count as one cell."""
        return (self.cells_per_step or 1.0) / self.mesh

    @property
    def effort(self) -> float:
        """Return an estimate of the work, points times steps."""
        return self.mesh**2 / self.time_step

    def __str__(self) -> str:
        return f"mesh {self.mesh}, {self.steps}, {self.integrator}"

    @property
    def directory(self) -> Path:
        """Return the directory of the case in the study's directory. Its name follows from the settings, so that a
        study with more values finds its earlier cases."""
        cells = AUTO if self.cells_per_step is None else f"{self.cells_per_step:.9g}"
        return Path(CASES, f"{self.mesh}-{cells}-{self.integrator}")

    @property
    def steps(self) -> str:
        if self.cells_per_step is None:
            return "auto steps"
        return f"{self.cells_per_step:.4g} cell{'s' if self.cells_per_step > 1.0 else ''} per step"


@dataclass(frozen=True)
class Ladders:
    """Lists of settings from coarse to fine; a single value for a setting that is not varied.

    `own` are the settings of the job itself. If the program chooses the steps of all cases, they may have an error in
    common that no comparison shows: `shared` is the accuracy for which steps are chosen, else 0. Friction is assessed
    only if `slides`, that is, if a stage slides.
    """

    meshes: tuple[int, ...]
    cells: tuple[float | None, ...]
    integrators: tuple[str, ...]
    own: Settings
    shared: float = 0.0
    slides: bool = True

    def combine(self) -> list[Settings]:
        """Return all different combinations, the cheapest first."""
        found = set(itertools.starmap(Settings, itertools.product(self.meshes, self.cells, self.integrators)))
        coarse, finest = self.cells[0], self.meshes[-1]  # time step of the refinement of the mesh alone
        for mesh, integrator in itertools.product(self.meshes, self.integrators):
            found.add(Settings(mesh, coarse and coarse * mesh / finest, integrator))
        return sorted(found, key=lambda case: (case.effort, str(astuple(case))))


def _has_time_steps(job: Job) -> bool:
    """Return True if a stage slides or has a given time step, so that a study can refine its steps."""
    return any(stage.speed or stage.time_step not in (None, AUTO) for stage in job.history)


def ladders(job: Job) -> Ladders:
    """Return the lists of settings of a job's study. Raises InputError if there is none."""
    study, numerics = job.study, job.numerics
    if study is None:
        raise InputError("no ladders: add a study section to the job, like study: {mesh: [256, 512, 1024]}")
    if study.cells_per_step and not _has_time_steps(job):
        raise InputError("study.cells_per_step: no stage slides or has a time step; leave it out")
    own = next((stage.cells_per_step for stage in job.history if stage.cells_per_step is not None), None)
    if own is None and not _sliding(job) and _has_time_steps(job):
        steps = ((stage, stage.time_step) for stage in job.history if stage.speed)
        own = next((dt / one_cell(stage, job.grid) for stage, dt in steps if isinstance(dt, float)), 1.0)
    if own is None and study.cells_per_step:
        own = 1.0
    case = Settings(job.grid.nx, own, numerics.integrator)
    meshes = tuple(sorted(study.mesh)) or (job.grid.nx,)
    cells: tuple[float | None, ...] = tuple(sorted(study.cells_per_step, reverse=True)) or (own,)
    chosen = any(stage.chooses for stage in job.history) if own is None else _sliding(job) and not study.cells_per_step
    shared = numerics.asked.of_steps if chosen else 0.0
    slides = any(stage.speed for stage in job.history)
    return Ladders(meshes, cells, study.integrator or (numerics.integrator,), case, shared, slides)


def overrides(job: Job, own: Settings, case: Settings) -> list[str]:
    """Return the overrides that change the job with its `own` settings to a case. All given time steps change by the
    ratio of the case's time step to that of `own`."""
    ny = 1 if job.grid.ny == 1 else case.mesh * job.grid.ny // job.grid.nx
    words = [f"grid.points=[{case.mesh}, {ny}]", "output.fields=[]", "output.every=1", "output.energy=false"]
    words += [
        "output.branch_dissipation=false",
        "checkpoint.keep=0",
        "study=null",
        f"numerics.integrator={case.integrator}",
    ]
    words.append(f"numerics.tolerance={job.numerics.tolerance!r}")  # the job's tolerance, also if the accuracy chose it
    words += [f"{key}={value!r}" for key, value in _chosen_values(job)]
    factor = case.time_step / own.time_step
    replaced = _sliding(job) if job.study and job.study.cells_per_step else []
    for index, stage in enumerate(job.history):
        place = f"history.{index}"
        if stage in replaced:
            words += [f"{place}.time_step=null", f"{place}.cells_per_step={case.cells_per_step!r}"]
        elif stage.cells_per_step is not None:
            cells = stage.cells_per_step * factor * case.mesh / own.mesh
            words.append(f"{place}.cells_per_step={cells!r}")
        elif isinstance(stage.time_step, GeometricStep):
            first, growth = stage.time_step.first * factor, stage.time_step.growth**factor
            words.append(f"{place}.time_step={{first: {first!r}, growth: {growth!r}}}")
        elif stage.time_step is not None and stage.time_step != AUTO:
            words.append(f"{place}.time_step={stage.time_step * factor!r}")
    return words


def make_cases(job: Job, refined: Ladders, make: MakeJob) -> dict[Settings, Case]:
    """Return the cases of a study with their directories. Raises InputError with the mistakes of the first wrong
    case."""
    cases = dict[Settings, Case]()
    for one in refined.combine():
        try:
            made = make(overrides(job, refined.own, one))
        except InputError as error:
            said = re.sub(r"(?m)^--set [^:]*: ", "", str(error))
            raise InputError(f"study, case {one}: {said}") from error
        output = made.output.model_copy(update={"directory": job.output.directory / one.directory})
        values = {"mesh": one.mesh, "cells_per_step": one.cells_per_step or AUTO, "integrator": one.integrator}
        cases[one] = Case(len(cases), values, made.model_copy(update={"output": output}))
    return cases


def _sliding(job: Job) -> list[Stage]:
    """Return the sliding stages that choose their steps."""
    return [stage for stage in job.history if stage.chooses and stage.speed]


def _chosen_values(job: Job) -> list[tuple[str, float]]:
    """Return the lengths [m] that effects choose by the mesh of the job, with their keys."""
    return [pair for asked in job.asked("chosen_values") for pair in asked(job).items()]


def describe_choices(job: Job) -> list[str]:
    """Return sentences on the settings that are equal in every case, or chosen by the accuracy."""
    own = f"{job.grid.nx} x {job.grid.ny} points, the job's own mesh"
    lines = [f"{key}: {value:.4g} m in every case, chosen by auto for {own}" for key, value in _chosen_values(job)]
    refined = _sliding(job) if job.study and job.study.cells_per_step else []
    if stages := [stage.name for stage in job.history if stage.chooses and stage not in refined]:
        bound = f"numerics.accuracy = {job.numerics.asked.of_steps:g}"
        lines.append(f"the time steps of {', '.join(dict.fromkeys(stages))} are chosen in every case, for {bound}")
    return lines


LEAST_ORDER, LARGEST_ORDER = 0.3, 6.0  # accuracy: range of orders of converging values
DOUBT = 0.5  # accuracy: uncertainty of the order
LEAST_DOUBT = 0.25  # accuracy: least uncertainty of the limit over the last difference


@dataclass(frozen=True)
class Limit:
    """The limit of a sequence, its order (NaN if none was found), and its uncertainty (NaN if unknown)."""

    value: float
    order: float
    uncertainty: float

    @property
    def doubt(self) -> float:
        """Return the relative uncertainty; 0 for a value of 0, such as friction at rest."""
        return abs(self.uncertainty / self.value) if self.value else 0.0


def extrapolate(sizes: Sequence[float], values: Sequence[float]) -> Limit:
    """Return the limit for size 0 of at least two values at decreasing sizes.

    If there are two values only, or values do not converge monotonically, the limit is the finest value. Its
    uncertainty is then the larger of the last two differences, or the only difference; NaN if the differences are 0.
    """
    last = abs(values[-1] - values[-2])
    order = _order(sizes[-3:], values[-3:]) if len(values) > 2 else math.nan
    if math.isnan(order):
        before = abs(values[-2] - values[-3]) if len(values) > 2 else last
        return Limit(values[-1], math.nan, max(last, before) or math.nan)
    value = _limit(sizes, values, order)
    doubts = [abs(_limit(sizes, values, max(order + more, LEAST_ORDER)) - value) for more in (-DOUBT, DOUBT)]
    doubts.append(LEAST_DOUBT * last)
    if len(values) > 3:
        doubts.append(abs(extrapolate(sizes[:-1], values[:-1]).value - value))
    return Limit(value, order, max(doubts))


def _limit(sizes: Sequence[float], values: Sequence[float], order: float) -> float:
    return values[-1] + (values[-1] - values[-2]) / ((sizes[-2] / sizes[-1]) ** order - 1.0)


def _order(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the order p of three values on `f* + c h^p`; NaN if it is outside of the range of orders."""
    before, after = values[0] - values[1], values[1] - values[2]
    if after == 0.0 or before / after <= 0.0:
        return math.nan
    wanted = before / after
    h3, h2, h1 = sizes

    def ratio(p: float) -> float:
        return float((h3**p - h2**p) / (h2**p - h1**p))

    if not ratio(LEAST_ORDER) <= wanted <= ratio(LARGEST_ORDER):
        return math.nan
    return float(brentq(lambda p: ratio(p) - wanted, LEAST_ORDER, LARGEST_ORDER))


QUANTITIES = ("mu_max", "mu_dyn", "contact_area", "contact_area_corrected")
TARGETS = (0.05, 0.03, 0.01, 0.003)
FRICTION = ("mu_max", "mu_dyn")
NEEDED = (*FRICTION, "contact_area_corrected")  # quantities that the sentences assess
TOGETHER, TIME, CHOSEN = "mesh and time together", "time alone", "mesh with auto steps"  # ladders
Outcome = Mapping[str, float]  # a row of sweep.csv
Outcomes = Mapping[Settings, Outcome]


@dataclass(frozen=True)
class StudyFinding:
    """The limit of one quantity along one list of settings, for one integrator."""

    quantity: str
    integrator: str
    ladder: str
    limit: Limit

    def __str__(self) -> str:
        last = "no order found: value of the last case, and its difference to earlier and finer ones"
        order = last if math.isnan(self.limit.order) else f"order {self.limit.order:.2f}"
        name = f"{self.quantity} with {self.integrator}, {self.ladder}"
        if math.isnan(self.limit.uncertainty):
            return f"{name}: {self.limit.value:.4g} in the last cases, which do not differ: its error is unknown"
        value = with_error(self.limit.value, abs(self.limit.value) * self.limit.doubt)
        return f"{name}: {value} ({per_cent(self.limit.doubt)}), {order}"


def sequences(ladders: Ladders, outcomes: Outcomes, integrator: str) -> dict[str, tuple[list[float], list[Settings]]]:
    """Return the sizes and the cases of each refinement from coarse to fine, by its name.

    The refinements are mesh and time together, mesh alone, and time alone; if no steps are given, the mesh.
    """
    usual = [case for case in outcomes if case.integrator == integrator]
    coarse, finest = ladders.cells[0], ladders.meshes[-1]
    together = sorted((c for c in usual if _is_same(c.cells_per_step, coarse)), key=lambda case: case.mesh)
    if coarse is None:
        return {CHOSEN: ([1.0 / c.mesh for c in together], together)} if len(together) > 1 else {}
    step = coarse / finest
    mesh = sorted((c for c in usual if math.isclose(c.time_step, step)), key=lambda case: case.mesh)
    time = sorted((c for c in usual if c.mesh == finest), key=lambda case: -case.time_step)
    time = [case for case in time if any(_is_same(case.cells_per_step, cells) for cells in ladders.cells)]
    found = {
        TOGETHER: ([1.0 / c.mesh for c in together], together),
        "mesh alone": ([1.0 / c.mesh for c in mesh], mesh),
        TIME: ([c.time_step for c in time], time),
    }
    return {name: pair for name, pair in found.items() if len(pair[1]) > 1}


def _is_same(one: float | None, other: float | None) -> bool:
    """Return True if cells per step are equal; None means chosen steps."""
    return one == other if one is None or other is None else math.isclose(one, other)


def judged(ladders: Ladders) -> list[str]:
    """Return the quantities whose errors are assessed: friction only if something slides."""
    return [name for name in QUANTITIES if ladders.slides or name not in FRICTION]


def limits(ladders: Ladders, outcomes: Outcomes) -> list[StudyFinding]:
    """Return the limit of every quantity along every refinement."""
    found = []
    for integrator in ladders.integrators:
        for name, (sizes, cases) in sequences(ladders, outcomes, integrator).items():
            for quantity in judged(ladders):
                values = [outcomes[case][quantity] for case in cases]
                found.append(StudyFinding(quantity, integrator, name, extrapolate(sizes, values)))
    return found


def references(ladders: Ladders, outcomes: Outcomes) -> dict[str, Limit]:
    """Return the reference of each quantity: a limit along mesh and time together, or along time alone if meshes are
    not varied. If some limits have an order, the reference is the least uncertain of these limits, else the least
    uncertain of all limits.

    Without such a refinement, or without differences, the reference is the most expensive case, with unknown error.
    Errors that all cases have in common do not show in a limit, so that the uncertainty of the reference is at least
    `ladders.shared`.
    """
    found = [one for one in limits(ladders, outcomes) if one.ladder == TIME]
    if len(ladders.meshes) > 1:
        each = [replace(ladders, cells=(cells,)) for cells in ladders.cells]
        found = [one for part in each for one in limits(part, outcomes) if one.ladder in (TOGETHER, CHOSEN)]
    dearest = max(outcomes, key=lambda case: case.effort)
    best = {name: Limit(outcomes[dearest][name], math.nan, math.nan) for name in judged(ladders)}
    for quantity in best:
        choices = [one.limit for one in found if one.quantity == quantity and one.limit.value]
        if choices:
            limit = min(choices, key=lambda one: (math.isnan(one.doubt), math.isnan(one.order), one.doubt))
            best[quantity] = replace(limit, uncertainty=max(limit.uncertainty, ladders.shared * abs(limit.value)))
    return best


def estimate_errors(outcome: Outcome, reference: Mapping[str, Limit]) -> dict[str, float]:
    """Return the relative error of each quantity; NaN if the reference is 0, such as friction at rest."""
    return {
        name: abs(outcome[name] / limit.value - 1.0) if limit.value else math.nan for name, limit in reference.items()
    }


def proven(error: Mapping[str, float], reference: Mapping[str, Limit]) -> dict[str, float]:
    """Return each error, or the uncertainty of its reference if this is larger: smaller errors cannot be seen."""
    return {name: doubt if value < (doubt := reference[name].doubt) else value for name, value in error.items()}


def worst(error: Mapping[str, float]) -> float:
    """Return the largest of the assessed errors; NaN if there are none."""
    values = [error[name] for name in NEEDED if not math.isnan(error.get(name, math.nan))]
    return max(values, default=math.nan)


def sentences(outcomes: Outcomes, reference: Mapping[str, Limit], ranks: int) -> list[str]:
    """Return sentences: for each error in TARGETS the fastest settings whose errors are at most as large, and the error
    of the reference."""
    error = {case: worst(proven(estimate_errors(outcome, reference), reference)) for case, outcome in outcomes.items()}
    if all(map(math.isnan, error.values())):
        return ["there is no contact, and no error"]
    needed = [name for name in NEEDED if name in reference]
    on = "1 rank" if ranks == 1 else f"{ranks} ranks"
    lines = [f"the fastest settings with errors of {', '.join(needed)} within a bound, times of all steps on {on}:"]
    for target in TARGETS:
        enough = [case for case in outcomes if error[case] <= target]
        case = min(enough, key=lambda case: outcomes[case]["seconds"], default=None)
        found = f"{case}; {outcomes[case]['seconds']:.3g} s" if case else "none of these settings is good enough"
        lines.append(f"for {per_cent(target)}: {found}")
    doubt = worst({name: limit.doubt for name, limit in reference.items() if limit.value})
    known = "is not known" if math.isnan(doubt) else f"is {100 * doubt:.2g} %"
    if doubt > max(TARGETS):
        known += ": add finer values to the lists of the study to make it smaller"
    return [*lines, f"the error of the reference, to which they are compared, {known}"]


ENDS = {
    STOPPED_EARLY: "stopped early; run again to go on",
    FAILED: "some cases failed: there is no limit",
    BAD_INPUT: "all cases were refused",
}
Errors = Mapping[Settings, Mapping[str, float]]


def run_study(job: Job, make: MakeJob, slab: Slab, quiet: bool) -> int:
    """Run all cases of a study, one after the other on all ranks; collective. Return the exit code.

    `make` returns the job changed by overrides. All jobs are read before the first case runs. After a stop the same
    command continues. The directory has the files of a sweep, and the results of the study once all cases are
    finished.
    """
    refined = ladders(job)
    cases = make_cases(job, refined, make)
    directory = Directory(job.output.directory, slab, "study")
    with directory.claimed():
        plain = plain_job(job) if slab.root else {}
        directory.refuse_foreign(job.path, plain, False)
        known = slab.agree(directory.claim is not None)
        directory.make(job.path, job.resolved(), outputs.Claim(outputs.kept(plain)))
        several = list(cases.values())
        shown = on_root(slab.comm, lambda: sweep.warn_once(several))
        warm_up(several[0].job, slab)
        stop = on_root(slab.comm, lambda: sweep.stop_file(several))

        def act(one: Job, own: Slab, shows: sweep.Shows) -> int:
            return run.run_job(one, own, Options(True, sweep_stop_file=stop, shows=shows))

        code = sweep.SweepRun(several, Groups(slab.comm), act, stop, quiet, shown=shown).run(several)
        if code == BAD_INPUT and not known:
            directory.withdraw(job.path)
        lines = [] if code else on_root(slab.comm, lambda: conclude(job, refined, cases, slab.comm.size))
        if slab.root and not quiet:
            print(*lines, ENDS.get(code, f"study: {directory.path}"), sep="\n", flush=True)
    return code


def conclude(job: Job, refined: Ladders, cases: Mapping[Settings, Case], ranks: int) -> list[str]:
    """Write limits, errors and a picture of the finished cases; return the sentences of study.txt; root only."""
    place = job.output.directory
    rows = dict(zip(cases, Results(place, "sweep").cases, strict=True))
    if not refined.slides:
        rows = {case: {**row, **_mean_areas(cases[case].job.output.directory)} for case, row in rows.items()}
    reference = references(refined, rows)
    errors = {case: estimate_errors(row, reference) for case, row in rows.items()}
    named = {case: {f"error_{name}": error for name, error in found.items()} for case, found in errors.items()}
    table = [{**row, **named[case], **cases[case].settings, "case": cases[case].number} for case, row in rows.items()]
    sweep.save_cases(place / "study.csv", names_of(STUDY), table)
    lines = [*describe_choices(job), *map(str, limits(refined, rows))]
    lines += sentences(rows, reference, ranks)
    files.replace_file(place / outputs.STUDY_TEXT, "\n".join(lines) + "\n")
    doubts = {name: limit.doubt for name, limit in reference.items()}
    plot_study(place, _curves(refined, rows, errors), doubts)
    return lines


def _mean_areas(directory: Path) -> dict[str, float]:
    """Return the contact areas of a run as means over its time, or over its loads if it takes no time."""
    columns, found = tables.read_columns(directory / outputs.RUN.table), dict[str, float]()
    for name in ("contact_area", "contact_area_corrected"):
        time, area = np.array([columns["time"], columns[name]])[:, 1:]  # without the initial state
        span = time[-1] - time[0]
        found[name] = float(np.trapezoid(area, time) / span if span else np.mean(area))
    return found


# -- the picture -------------------------------------------------------------------------------------------------------

NAMES = {"mu_max": "largest friction", "mu_dyn": "dynamic friction", "contact_area_corrected": "contact area"}
MARKS = {  # mark and dashes of a ladder
    TOGETHER: ("o", "-"),
    CHOSEN: ("D", "-"),
    "mesh alone": ("s", "--"),
    TIME: ("^", ":"),
}
COLORS = {"exponential": style.BLUE, "exponential-linear": style.GREEN, "backward-euler": style.RED}
GREY = 5.0  # ratio of the edges of the grey band
LEAST_ERROR = 1e-7  # smallest error on the axis; smaller ones are drawn there


@dataclass(frozen=True)
class StudyCurve:
    """Errors of one quantity along a `ladder`, a list of more and more refined settings. `sizes` are the sizes of their
    cells or steps relative to the box, `seconds` the wall times of all their steps."""

    quantity: str
    integrator: str
    ladder: str
    sizes: Sequence[float]
    errors: Sequence[float]
    seconds: Sequence[float]

    def over(self, x: Array) -> Line:
        """Return the curve of the errors [%] against the values x."""
        mark, dashes = MARKS[self.ladder]
        look = {"color": COLORS[self.integrator], "marker": mark, "linestyle": dashes}
        return Line(f"{self.ladder}, {self.integrator}", x, _per_cent(self.errors), look)


def plot_study(directory: Path, curves: Sequence[StudyCurve], doubts: Mapping[str, float]) -> Path | None:
    """Draw `convergence.png` of a study and return its path; None if nothing is refined.

    `doubts` has the relative uncertainty of the reference of each quantity. A grey band of the panel shows errors below
    this uncertainty.
    """
    drawn = [curve for curve in curves if any(0.0 < error < math.inf for error in curve.errors)]
    if not drawn:
        return None
    own: dict[str, list[StudyCurve]] = {}
    for curve in drawn:
        own.setdefault(curve.quantity, []).append(curve)
    panels = [panel for name, found in own.items() for panel in _errors(name, found, doubts[name])]
    with style.drawing():
        return style.save_figure(picture("", [panels]), directory / outputs.STUDY_PICTURE)


def _errors(name: str, curves: Sequence[StudyCurve], doubt: float) -> list[Panel]:
    """Return the panels of errors of a quantity over the refinement of mesh or step with respect to the coarsest, and
    over time, on axes of at least a decade; grey up to the uncertainty `doubt` of the reference."""
    errors = _per_cent([error for curve in curves for error in curve.errors if math.isfinite(error)])
    low, high = _widened(errors)
    y, shades = Axis(f"{NAMES[name]}:\nerror [%]"), list[Shade]()
    if 0.0 < doubt < math.inf:
        low, high = min(max(low, 100 * doubt / GREY), 100 * doubt), max(high, 200 * doubt)
        shades.append(Shade("", low, 100 * doubt, "y"))
    finer = Axis("refinement, coarsest = 1"), [max(one.sizes) / np.asarray(one.sizes) for one in curves]
    times = Axis("time of all steps", "s"), [np.asarray(one.seconds, float) for one in curves]
    panels, logarithmic = [], Panel(name, Axis(""), y, shades=shades, log_x=True, log_y=True, y_range=(low, high))
    for x, places in (finer, times):
        lines = [one.over(at) for one, at in zip(curves, places, strict=True)]
        panels.append(replace(logarithmic, x=x, series=lines, x_range=_widened(np.concatenate(places))))
    return panels


def _widened(values: Array) -> tuple[float, float]:
    """Return limits of a logarithmic axis around values, at least a decade apart, so that there are ticks."""
    low, high = float(values.min()), float(values.max())
    middle, half = math.sqrt(low * high), max((high / low) ** 0.55, math.sqrt(10.0))
    return middle / half, middle * half


def _per_cent(errors: Sequence[float]) -> Array:
    return 100 * np.maximum(errors, LEAST_ERROR)


def _curves(refined: Ladders, rows: Outcomes, errors: Errors) -> list[StudyCurve]:
    """Return the errors along each ladder."""
    return [
        StudyCurve(
            *(quantity, integrator, name, sizes),
            [errors[case][quantity] for case in cases],
            [rows[case]["seconds"] for case in cases],
        )
        for integrator in refined.integrators
        for name, (sizes, cases) in sequences(refined, rows, integrator).items()
        for quantity in NEEDED
        if quantity in errors[cases[0]]
    ]
