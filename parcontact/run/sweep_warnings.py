"""Warnings of the cases of a sweep: each kind is shown once, with the cases that it holds for."""

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence

from ..job import Case, Job

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(\.\d+)?(e[-+]?\d+)?")  # in which warnings of one kind may differ

Kinds = dict[str, tuple[str, list[int]]]  # the first text of each kind, and the numbers of the cases that have it


class SweepWarnings:
    """Warnings by kind. Kinds of which texts were `told` before are not shown; others `at_once`, or only at the end."""

    def __init__(self, told: Sequence[str] = (), at_once: bool = True) -> None:
        self._told, self._at_once, self._case = frozenset(map(_kind, told)), at_once, -1
        self.kinds: Kinds = {}

    def begin(self, case: int) -> None:
        """Take what follows to be of this case."""
        self._case = case

    def shows(self, text: str) -> bool:
        """Note a warning; whether it is to be shown now."""
        if _kind(text) in self._told:
            return False
        _, cases = self.kinds.setdefault(_kind(text), (text, []))
        new = not cases
        if self._case not in cases:
            cases.append(self._case)
        return new and self._at_once

    def summary(self, of_groups: Sequence[Kinds]) -> list[str]:
        """Return what is to be said at the end of what all groups of ranks have noted: what was not shown yet, or is
        not of one case alone."""
        whole: Kinds = {}
        for kinds in of_groups:
            for kind, (text, cases) in kinds.items():
                whole.setdefault(kind, (text, []))[1].extend(cases)
        told = [(text, sorted(cases)) for text, cases in whole.values() if len(cases) > 1 or not self._at_once]
        return [f"{text} ({name_cases(cases)})" for text, cases in told]


def _kind(text: str) -> str:
    return NUMBER.sub("#", text)


def doubts_of(cases: Sequence[Case], doubts: Callable[[Job], Iterable[str]]) -> list[str]:
    """Return the doubts about the jobs of cases, each kind once; of several with the cases that it holds for."""
    if len(cases) == 1:
        return list(dict.fromkeys(doubts(cases[0].job)))
    noted = SweepWarnings(at_once=False)
    for case in cases:
        noted.begin(case.number)
        for text in doubts(case.job):
            noted.shows(text)
    return [*noted.summary([noted.kinds]), *_follow_the_mesh(cases)]


def _follow_the_mesh(cases: Sequence[Case]) -> Iterator[str]:
    """Yield what to say of cases that have different ranges of adhesion, though none is given."""
    if not any(case.job.section("adhesion") for case in cases):
        return
    from ..effects.adhesion import chosen_range  # not for what checks jobs without adhesion

    reaches = {reach for case in cases if (reach := chosen_range(case.job)) is not None}
    if len(reaches) > 1:
        yield (
            f"adhesion.range: auto follows cells, work and modulus, from {min(reaches):.4g} to {max(reaches):.4g} m in "
            "these cases, which are different physics; to compare them give one range to all: the cells of each "
            f"resolve {max(reaches):.4g} m"
        )


def warn_once(cases: Sequence[Case]) -> list[str]:
    """Warn of what is doubtful about the jobs of cases, each kind once; root only. Returns all texts."""
    for text in doubts_of(cases, lambda job: job.warnings):
        print(f"warning: {text}", file=sys.stderr, flush=True)
    return [text for case in cases for text in case.job.warnings]


def name_cases(numbers: Sequence[int]) -> str:
    """Return ascending numbers as `cases 0, 2-5`."""
    starts = [number for number in numbers if number - 1 not in numbers]
    ends = [number for number in numbers if number + 1 not in numbers]
    pairs = zip(starts, ends, strict=True)
    listed = ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in pairs)
    return f"case{'s' * (len(numbers) > 1)} {listed}"
