"""`parcontact study`: runs all cases in turn, with a row of study.csv for each; then limits and pictures."""

import hashlib
import os
from collections.abc import Callable, Sequence

from ..errors import RunError
from ..job import Job
from ..job.sections.listing import plain_job
from ..parallel.signals import Signals
from ..parallel.slab import Slab
from ..plotting import study_pictures as study_plots
from ..storage import files, marker, stopfile
from ..storage.directory import Directory
from . import outcome, verdict
from .ladders import Ladders, MakeJob, Settings, describe_choices, ladders, make_jobs
from .outcome import Outcome, read_outcomes, write_outcomes

DONE, AGAIN = 0, 3  # exit codes


def run_study(job: Job, make: MakeJob, slab: Slab, quiet: bool) -> int:
    """Run a study; collective. `make` returns the job changed by overrides; returns the exit code.

    All jobs are read before the first case runs. After a stop the same command continues with the missing cases.
    """
    refined = ladders(job)
    jobs = make_jobs(job, refined, make)
    directory = Directory(job.output.directory, slab, "study")
    with Signals().noted() as signals, directory.claimed():
        plain = plain_job(job) if slab.root else {}
        directory.refuse_foreign(job.path, plain, False)
        directory.make(job.path, job.resolved(), marker.Claim(marker.kept(plain)))
        study = _Study(refined, jobs, directory, quiet)
        stop = directory.stop_file
        ended = study.run(lambda: signals.stop or (slab.root and os.path.lexists(stop)))
        if not ended:
            if problem := slab.agree(stopfile.remove(stop) if slab.root else ""):
                raise RunError(problem)
            study.say(f"stopped after {len(study.outcomes)} of {len(jobs)} cases; run again to go on")
            return AGAIN
        study.conclude(describe_choices(job))
    return DONE


class _Study:
    """The cases of a study and their outcomes so far."""

    def __init__(self, refined: Ladders, jobs: dict[Settings, Job], directory: Directory, quiet: bool) -> None:
        self.refined, self.jobs, self.slab, self.quiet = refined, jobs, directory.slab, quiet
        self.path = directory.path / "study.csv"
        self.prints = {case: _fingerprint(one) for case, one in jobs.items()}
        known = read_outcomes(self.path, self.prints) if self.slab.root else {}
        self.outcomes: dict[Settings, Outcome] = self.slab.agree(known)

    def say(self, text: str) -> None:
        if self.slab.root and not self.quiet:
            print(text, flush=True)

    def run(self, stopped: Callable[[], bool]) -> bool:
        """Run the missing cases; return True if all are finished."""
        self.say(f"{len(self.jobs)} cases" + f", {len(self.outcomes)} of them finished before" * bool(self.outcomes))
        self.say(f"  {'case':50}{' friction max' * self.refined.slides} {'area':>9} {'CPU [s]':>8}")
        for case, job in self.jobs.items():
            if case not in self.outcomes:
                found = self._one(case, job, stopped)
                if found is None:
                    return False
                self.outcomes[case] = found
                if self.slab.root:
                    write_outcomes(self.path, self.prints, self.outcomes)
            one = self.outcomes[case]
            friction = f" {one.mu_max:13.6g}" * self.refined.slides
            self.say(f"  {case!s:50}{friction} {one.area_corrected:9.5f} {one.cpu_seconds:8.2f}")
        return True

    def _one(self, case: Settings, job: Job, stopped: Callable[[], bool]) -> Outcome | None:
        slab = self.slab.resized(*job.grid.points)
        try:
            return outcome.march_through(job, slab, stopped)
        except RunError as error:
            raise RunError(f"{case}: {error}") from error

    def conclude(self, notes: Sequence[str]) -> None:
        """Write limits, errors, pictures and sentences."""
        if not self.slab.root:
            return
        ordered = {case: self.outcomes[case] for case in self.jobs}
        reference = verdict.references(self.refined, ordered)
        errors = {case: verdict.errors(found, reference) for case, found in ordered.items()}
        write_outcomes(self.path, self.prints, ordered, errors)
        lines = [*notes, *map(str, verdict.limits(self.refined, ordered))]
        lines += verdict.sentences(ordered, reference, self.slab.comm.size)
        files.replace_file(self.path.with_suffix(".txt"), "\n".join(lines) + "\n")
        doubts = {name: limit.doubt for name, limit in reference.items()}
        study_plots.plot_study(self.path.parent, self._curves(ordered, errors), doubts)
        for line in (*lines, f"done: {self.path.parent}"):
            self.say(line)

    def _curves(
        self, outcomes: dict[Settings, Outcome], errors: dict[Settings, dict[str, float]]
    ) -> list[study_plots.StudyCurve]:
        """Return the errors along each ladder."""
        return [
            study_plots.StudyCurve(quantity, integrator, name, sizes, [errors[case][quantity] for case in cases])
            for integrator in self.refined.integrators
            for name, (sizes, cases) in verdict.sequences(self.refined, outcomes, integrator).items()
            for quantity in verdict.NEEDED
            if quantity in errors[cases[0]]
        ]


def _fingerprint(job: Job) -> str:
    """Return a fingerprint of everything that determines the outcome of a case."""
    lasting = job.model_copy(update={"study": None, "output": None, "checkpoint": None, "title": ""})
    return hashlib.sha256(lasting.resolved().encode()).hexdigest()[:12]
