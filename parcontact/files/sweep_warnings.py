"""Warnings of the cases of a sweep: each subject is shown once, with its cases."""

import sys
from collections.abc import Callable, Iterable, Sequence

from ..errors import Doubt
from ..job import Case, Job
from ..printed import name_cases

# first warning of each subject, and the numbers of its cases
Kinds = dict[tuple[str, ...], tuple[Doubt, list[int]]]


class SweepWarnings:
    """Warnings of a sweep by subject. Subjects of the warnings `shown` before are not shown again. Others are shown
    immediately if `at_once` is True, else at the end."""

    def __init__(self, shown: Sequence[Doubt] = (), at_once: bool = True) -> None:
        self._shown, self._at_once, self._case = frozenset(doubt.subject for doubt in shown), at_once, -1
        self.kinds: Kinds = {}

    def begin(self, case: int) -> None:
        """Set the case to which the following warnings belong."""
        self._case = case

    def shows(self, doubt: Doubt) -> bool:
        """Record a warning; return True if it is shown now."""
        if doubt.subject in self._shown:
            return False
        _, cases = self.kinds.setdefault(doubt.subject, (doubt, []))
        new = not cases
        if self._case not in cases:
            cases.append(self._case)
        return new and self._at_once

    def summary(self, of_groups: Sequence[Kinds]) -> list[str]:
        """Return the messages at the end: warnings that were not yet shown, or that several cases have. `of_groups` has
        the attribute `kinds` of each group of ranks."""
        whole: Kinds = {}
        for kinds in of_groups:
            for subject, (doubt, cases) in kinds.items():
                whole.setdefault(subject, (doubt, []))[1].extend(cases)
        found = [(doubt, sorted(cases)) for doubt, cases in whole.values() if len(cases) > 1 or not self._at_once]
        return [f"{doubt} ({name_cases(cases)})" for doubt, cases in found]


def sentences_of(cases: Sequence[Case], doubts: Callable[[Job], Iterable[Doubt]]) -> list[str]:
    """Return the warnings about the jobs of cases as sentences, one per subject, with the cases if there are
    several."""
    if len(cases) == 1:
        return list(dict.fromkeys(map(str, doubts(cases[0].job))))
    noted = SweepWarnings(at_once=False)
    for case in cases:
        noted.begin(case.number)
        for doubt in doubts(case.job):
            noted.shows(doubt)
    jobs = [case.job for case in cases]
    between = dict.fromkeys(asked for job in jobs for asked in job.asked("doubt_cases"))
    return [*noted.summary([noted.kinds]), *(str(doubt) for asked in between for doubt in asked(jobs))]


def warn_once(cases: Sequence[Case]) -> list[Doubt]:
    """Print the warnings about the jobs of cases, one per subject; root only. Returns all warnings."""
    for text in sentences_of(cases, lambda job: job.doubts):
        print(f"warning: {text}", file=sys.stderr, flush=True)
    return [doubt for case in cases for doubt in case.job.doubts]
