"""`parcontact study`: a sweep over meshes, steps and integrators; then limits, errors over time, and a picture."""

from collections.abc import Mapping

from ..columns import STUDY, names_of
from ..job import Case, Job
from ..job.sections.listing import plain_job
from ..parallel.groups import Groups
from ..parallel.root import on_root
from ..parallel.slab import Slab
from ..plan.trial import warm_up
from ..results import study_pictures as study_plots
from ..results import sweep_table
from ..results.results import Results
from ..run import runner, sweep, sweep_warnings
from ..run.run import STOPPED_EARLY, Options
from ..storage import files, marker
from ..storage.directory import Directory
from . import verdict
from .ladders import Ladders, MakeJob, Settings, describe_choices, ladders, make_cases

ENDS = {STOPPED_EARLY: "stopped early; run again to go on", sweep.FAILED: "some cases failed: there is no limit"}
Errors = Mapping[Settings, Mapping[str, float]]


def run_study(job: Job, make: MakeJob, slab: Slab, quiet: bool) -> int:
    """Run all cases of a study, one after the other on all ranks; collective. Return the exit code.

    `make` returns the job changed by overrides. All jobs are read before the first case runs. After a stop the same
    command continues. The directory has the results of a sweep, and those of the study once all cases are finished.
    """
    refined = ladders(job)
    cases = make_cases(job, refined, make)
    directory = Directory(job.output.directory, slab, "study")
    with directory.claimed():
        plain = plain_job(job) if slab.root else {}
        directory.refuse_foreign(job.path, plain, False)
        directory.make(job.path, job.resolved(), marker.Claim(marker.kept(plain)))
        several = list(cases.values())
        shown = on_root(slab.comm, lambda: sweep_warnings.warn_once(several))
        warm_up(several[0].job, slab)
        stop = on_root(slab.comm, lambda: sweep.stop_file(several))

        def act(one: Job, own: Slab, shows: sweep.Shows) -> int:
            return runner.run_job(one, own, Options(True, sweep_stop_file=stop, shows=shows))

        code = sweep.SweepRun(several, Groups(slab.comm), act, stop, quiet, shown=shown).run(several)
        lines = [] if code else on_root(slab.comm, lambda: conclude(job, refined, cases, slab.comm.size))
        if slab.root and not quiet:
            print(*lines, ENDS.get(code, f"study: {directory.path}"), sep="\n", flush=True)
    return code


def conclude(job: Job, refined: Ladders, cases: Mapping[Settings, Case], ranks: int) -> list[str]:
    """Write limits, errors and a picture of finished cases; return the sentences of study.txt; root only."""
    place = job.output.directory
    rows = dict(zip(cases, Results(place, "sweep").cases, strict=True))
    reference = verdict.references(refined, rows)
    errors = {case: verdict.errors(row, reference) for case, row in rows.items()}
    named = {case: {f"error_{name}": error for name, error in found.items()} for case, found in errors.items()}
    table = [{**row, **named[case], **cases[case].settings, "case": cases[case].number} for case, row in rows.items()]
    sweep_table.save_cases(place / "study.csv", names_of(STUDY), table)
    lines = [*describe_choices(job), *map(str, verdict.limits(refined, rows))]
    lines += verdict.sentences(rows, reference, ranks)
    files.replace_file(place / "study.txt", "\n".join(lines) + "\n")
    doubts = {name: limit.doubt for name, limit in reference.items()}
    study_plots.plot_study(place, _curves(refined, rows, errors), doubts)
    return lines


def _curves(refined: Ladders, rows: verdict.Outcomes, errors: Errors) -> list[study_plots.StudyCurve]:
    """Return the errors along each ladder."""
    return [
        study_plots.StudyCurve(
            *(quantity, integrator, name, sizes),
            [errors[case][quantity] for case in cases],
            [rows[case]["seconds"] for case in cases],
        )
        for integrator in refined.integrators
        for name, (sizes, cases) in verdict.sequences(refined, rows, integrator).items()
        for quantity in verdict.NEEDED
        if quantity in errors[cases[0]]
    ]
