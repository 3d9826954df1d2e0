"""Verbs of the command line, from options to exit code. Each imports its modules when it runs, to start quickly."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import InputError
from ..parallel.root import on_root
from . import ranks
from .each_case import OF_A_CURVE, cases_of, each_case, job_overrides

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator, Sequence

    from ..doubts import Doubt
    from ..job import Case, Job
    from ..parallel.slab import Slab
    from .each_case import Shows

DONE, FAILED, BAD_INPUT = 0, 1, 2  # exit codes; the runner has a fourth: stopped early, run again


def run(options: argparse.Namespace) -> int:
    """Run a job, or continue it (the default verb)."""
    return each_case(options, ranks.start_ranks(), _run)


def _run(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..run import runner
    from ..run.run import Options

    if not job.history:
        return _curve(options, job, slab, shows)
    sweep_stop_file = getattr(options, "sweep_stop_file", None)
    chosen = Options(
        options.quiet, options.restart, options.until, options.wall, sweep_stop_file=sweep_stop_file, shows=shows
    )
    if job.bands is not None:
        from ..run.road_run import run_history

        return run_history(job, slab, chosen)
    return runner.run_job(job, slab, chosen)


def steady(options: argparse.Namespace) -> int:
    """Calculate a friction curve: steady sliding, solved directly."""
    return each_case(options, ranks.start_ranks(), _curve)


def _curve(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..bands.road_sliding import make_states
    from ..results import prediction
    from ..run import watch
    from ..steady_sliding import curve

    asked = [getattr(options, name, ()) for name in OF_A_CURVE]
    wanted = curve.request(job, *asked)
    if options.restart not in ("auto", "never"):
        raise InputError(f"--restart: auto or never was expected for a friction curve, got {options.restart}")
    sweep_stop_file = getattr(options, "sweep_stop_file", None)
    end = watch.limit(getattr(options, "wall", None))
    limit = None if end is None else end - watch.RESERVE_SECONDS
    chosen = (options.quiet, options.restart, shows, sweep_stop_file, make_states, limit)
    return curve.run_curve(job, slab, wanted, *chosen, lambda: prediction.draw_curve(job, wanted))


@ranks.root_alone
def check(options: argparse.Namespace) -> int:
    """List all mistakes of a job, or all its keys with every default."""
    from .. import job as jobs
    from ..history.chosen import describe_steps
    from ..run.sweep_warnings import sentences_of

    cases, chosen = cases_of(options)
    job = chosen[0].job
    _check_study(options, chosen)
    print(jobs.describe_job(job))
    steps = "" if job.bands is not None else describe_steps(job)
    steps = steps and f"chosen time steps: {steps}"
    notes: list[list[str]] = []
    doubts = sentences_of(chosen, lambda one: _doubts(one, notes))
    notes[0] += _describe_waves(job)
    for text in filter(None, (job.included, job.origin.mesh, steps, *job.facts, "\n".join(notes[0]))):
        print(f"\n{text}")
    for warning in doubts:
        print(f"warning: {warning}")
    if cases[0].settings:
        print("\nsweep; its first case is shown above" if len(chosen) > 1 else "\nsweep")
        print("\n".join(map(str, chosen)))
    return DONE


def _check_study(options: argparse.Namespace, cases: Sequence[Case]) -> None:
    """Read all jobs of a study, also of each case of a sweep; raises InputError with their mistakes."""
    if cases[0].job.study is None:
        return
    from .. import mesh
    from ..study.ladders import ladders, make_cases

    for case in cases:
        number = case.number if case.settings else None

        def make(changes: Sequence[str], number: int | None = number) -> Job:
            return mesh.load(options.job, [*job_overrides(options), *changes], number)

        make_cases(case.job, ladders(case.job), make)


def _doubts(job: Job, notes: list[list[str]]) -> list[Doubt]:
    """Return the warnings about a job, its heights and its measured moduli; append a list of remarks on measured maps
    and spectra to `notes`."""
    notes.append([])
    degrees = (job.steady.temperatures if job.steady else None) or ()
    if job.bands is not None:
        from ..bands.choice import cut_bands, describe_cut, doubts_of_bands

        cut = cut_bands(job)
        notes[-1] += describe_cut(cut, job)
        return doubts_of_bands(job, cut, degrees)
    if not job.depends_on_heights and not job.measured:
        return list(job.doubts)
    from ..parallel.slab import Slab
    from ..scene import describe_roughness, sanity, set_up
    from ..scene.measured_range import doubt_band

    if not sanity.is_quickly_made(job):
        return [*job.doubts, *doubt_band(job, degrees)]
    setup = set_up(job, Slab.alone(*job.grid.points))
    notes[-1] += [*setup.remarks.notes, *describe_roughness(setup)]
    sanity.refuse_approaches(setup)
    return sanity.find_doubts(setup, degrees)


def _describe_waves(job: Job) -> list[str]:
    """Return sentences of effects on the waves of a surface on one grid."""
    if job.bands is not None or not job.asked("describe_waves"):
        return []
    from ..scene import sanity

    return sanity.describe_waves(job)


def plan(options: argparse.Namespace) -> int:
    """Estimate the steps, time, memory and disk of a job; writes nothing."""
    from ..run import watch

    started = watch.age()
    world = ranks.start_ranks()
    from itertools import chain

    from ..parallel.groups import Groups
    from ..parallel.slab import Slab
    from ..plan.memory import count_side_by_side
    from ..plan.planning import Planner
    from ..run.sweep_warnings import sentences_of

    chosen = on_root(world, lambda: cases_of(options)[1])
    first = chosen[0].job  # heights of other cases are not made for warnings, which `check` lists
    find = lambda job: _doubts(job, []) if job is first else list(job.doubts)  # noqa: E731
    doubts = on_root(world, lambda: sentences_of(chosen, find))
    planner = Planner(options.ranks or sorted({1, world.size, ranks.cores()}), options.seconds, started)
    if chosen[0].job.bands is not None:
        from ..bands.band_plan import plan_bands

        head = [f"first of {len(chosen)} cases:"] * (len(chosen) > 1)
        lines: Iterator[str] = chain(head, plan_bands(chosen[0].job, Slab(world, 1, 1)))
    elif len(chosen) > 1:
        at_once = on_root(world, lambda: count_side_by_side([case.job for case in chosen], world.size))
        lines = planner.plan_sweep(chosen, Groups(world, at_once))
    else:
        lines = planner.plan(chosen[0].job, Slab(world, *chosen[0].job.grid.points))
    said = on_root(world, lambda: _describe_waves(chosen[0].job))
    for line in (*(f"warning: {text}" for text in doubts), *said, *lines):
        if world.rank == 0:
            print(line, flush=True)
    return DONE


def theory(options: argparse.Namespace) -> int:
    """Predict friction and contact area by Persson's theory, into theory.csv."""
    return each_case(options, ranks.start_ranks(), _predict, runs=False)


def _predict(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..results import prediction

    lines = on_root(slab.comm, lambda: prediction.foretell(job, options.gamma, options.waves))
    if slab.root and not options.quiet:
        print(*lines, sep="\n", flush=True)
    return DONE


def _on_one_grid(job: Job) -> Job:
    """Return a job in bands as a job with one grid for all its waves."""
    if job.bands is None:
        return job
    from ..bands.choice import cut_bands, on_one_grid_of_all

    return on_one_grid_of_all(job, cut_bands(job))


@ranks.root_alone
def fit(options: argparse.Namespace) -> int:
    """Fit a material to measured moduli; write a material file and a picture."""
    from .. import mesh
    from ..job.checks.frequencies import excited_band
    from ..results import compound_files as files
    from ..rubber import compound
    from ..rubber.shift import read_shift

    target = options.out or options.table.with_suffix(".yaml")
    files.refuse_foreign(target)
    band = excited_band(_on_one_grid(mesh.load(options.job))) if options.job else None
    law = read_shift(options.shift, options.reference)
    of_fit = (options.error, options.weight, options.vertical)
    made = compound.fitted(options.table, options.poisson, options.reference, law, *of_fit)
    for line in files.write_compound(made, target, band):
        print(line)
    return DONE


def study(options: argparse.Namespace) -> int:
    """Run a job on finer and finer meshes and steps, and draw error over time; continues after a stop."""
    world = ranks.start_ranks()
    from ..parallel.slab import Slab
    from ..study import study as whole_study

    def make(changes: Sequence[str]) -> Job:
        return on_root(world, lambda: _load(options, changes))

    job = make(())
    return whole_study.run_study(job, make, Slab(world, *job.grid.points), options.quiet)


@ranks.root_alone
def surface(options: argparse.Namespace) -> int:
    """Describe and draw the surface of a job, or a measured map."""
    from pathlib import Path

    from ..parallel.slab import Slab
    from ..results.surface_summary import describe_surface
    from ..scene import sanity, set_up
    from . import measured_maps

    given = Path(options.job)
    picture, options.out = Path(options.out or f"{given.stem}-surface.png"), None
    alone = measured_maps.is_map(given)
    if options.start and not alone:
        raise InputError(f"--job writes a job for a measured map; {given} is a job")
    measured_maps.refuse_taken(options.start)
    job = measured_maps.load_map(given, options.set) if alone else _load(options)
    if job.bands is not None:
        raise InputError(f"{given} has bands, each with heights on a grid of its own: give it a grid instead (grid)")
    sanity.refuse_memory(job)
    base = set_up(job, Slab.alone(*job.grid.points))
    doubts = [doubt for doubt in job.doubts if doubt.place.startswith("surface")] + sanity.check_heights(base)
    base.surface.rescale(1.0)
    heights = base.surface.heights((0.0, 0.0), base.slab.empty())
    lines = describe_surface(job, heights, base.remarks.notes, base.shortest, picture)
    started = measured_maps.start_job(job, given, options.start) if alone else ()
    print("\n".join([*lines, *(f"warning: {doubt}" for doubt in doubts), *started]))
    return DONE


@ranks.root_alone
def info(options: argparse.Namespace) -> int:
    """Describe checkpoints, field files and output directories, and check them for damage."""
    from ..results import info as about

    text, sound = about.describe_all(options.file)
    print(text)
    return DONE if sound else BAD_INPUT


@ranks.root_alone
def plot(options: argparse.Namespace) -> int:
    """Draw runs and friction curves, compare several, or make a movie."""
    from ..results import plots

    names = ("format", "panels", "over", "log", "compare", "movie", "at", "out")
    wanted = plots.PlotOptions(**{name: getattr(options, name) for name in names})
    for picture in plots.plot(options.directories, wanted):
        print(f"picture: {picture}")
    return DONE


def leak(options: argparse.Namespace) -> int:
    """Calculate the leakage through the gaps of a run, into leak.csv; draw it."""
    world = ranks.start_ranks()
    from ..effects.leakage.fluids import PressureDrop
    from ..effects.leakage.over_time import write_leakage

    if (options.fluid is None) != (options.pressures is None):
        raise InputError("--fluid and --pressures HIGH:LOW [Pa] go together: give both, or none")
    total = options.load == "total"
    if total and options.fluid is None:
        raise InputError("--load total needs a fluid: give --fluid and --pressures HIGH:LOW [Pa]")
    if options.ambient is not None and not total:
        raise InputError("--ambient goes with --load total only")
    high, low = options.pressures or (0.0, 0.0)
    drop = PressureDrop(options.fluid, high, low, total, options.ambient) if options.fluid else None
    for directory in options.directories:
        lines = write_leakage(directory, options.at or "", options.over, world, drop)
        print(*lines, sep="\n", end="\n" if world.rank == 0 else "")
    return DONE


@ranks.root_alone
def report(options: argparse.Namespace) -> int:
    """Write one HTML file with job, results, data and versions."""
    from ..results import page

    print(f"report: {page.write_report(options.directories, options.out)}")
    return DONE


@ranks.root_alone
def export(options: argparse.Namespace) -> int:
    """Write friction, or leakage over the load, as a table for programs of finite elements."""
    from ..results import export as exports

    for line in exports.export_results(options.directory, options.format, options.out):
        print(line)
    return DONE


def doctor(options: argparse.Namespace) -> int:
    """Check this installation: exact solutions, ranks, files and times."""
    world = ranks.start_ranks()
    from pathlib import Path

    from ..doctor import machine
    from ..doctor.bench import Bench
    from ..doctor.installation_checks import CHECKS, markdown, run_check

    def show(text: str) -> None:
        if world.rank == 0:
            print(text, flush=True)

    for line in machine.describe_machine(world, Path.cwd()):
        show(line)
    results = [(check, run_check(check, Bench(world, options.precision))) for check in CHECKS]
    show("\n" + markdown(results))
    show("\n" + machine.prepare_loops(world))
    wrong = [f"{check.name}: {text}" for check, bench in results for text in bench.wrong]
    wrong += filter(None, [machine.find_broken_files(world, Path.cwd())])
    show("\n".join(wrong) or "all is well")
    return FAILED if wrong else DONE


@ranks.root_alone
def manual(options: argparse.Namespace) -> int:
    """Print a page of the manual, or list all pages."""
    import shutil

    from ..manual import texts

    width = min(shutil.get_terminal_size().columns, 100)
    print(
        texts.plain_page(options.page, {"verbs": options.describe_verbs}, width) if options.page else texts.contents()
    )
    return DONE


@ranks.root_alone
def schema(options: argparse.Namespace) -> int:
    """Print a JSON Schema of job files, for editors."""
    import json
    import sys

    from ..job import added_sections
    from ..job import schema as job_schema

    unknown = (
        f"{added_sections.describe_effect(name)} {reason}" for name, reason in job_schema.without_schema().items()
    )
    for text in (*added_sections.unusable(), *unknown):
        print(f"warning: {text}; the schema does not include it", file=sys.stderr)
    print(json.dumps(job_schema.json_schema(), indent=1))
    return DONE


@ranks.root_alone
def cite(options: argparse.Namespace) -> int:
    """List the publications to cite for a run."""
    from ..results import citations

    print(citations.describe_citations(options.directory))
    return DONE


def _load(options: argparse.Namespace, changes: Sequence[str] = ()) -> Job:
    """Return the job of the command line, with further changes."""
    from .. import mesh

    return mesh.load(options.job, [*job_overrides(options), *changes], options.case)
