"""Errors that end the program with a sentence, and warnings as data (kind, place, numbers) with their sentences.

Code that checks a job, a surface or a contact returns warnings as `Doubt` objects. Each `Kind` of warning is defined
next to the code that checks for it. No code compares or parses the sentences. The warnings of the cases of a sweep are
collected by subject, so that each subject is shown once, with its cases.
"""

import math
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .printed import name_cases, per_cent, quantity, rounded_down, rounded_up

DONE, FAILED, BAD_INPUT, STOPPED_EARLY = range(4)  # exit codes; stopped early: with a good checkpoint, run again


class InputError(Exception):
    """Bad input, described in one sentence. The command line writes nothing and ends with exit code 2."""


class JobError(InputError):
    """A job with mistakes; each of `mistakes` is a sentence that begins with file:line:column or the name of a key."""

    def __init__(self, mistakes: Sequence[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = list(mistakes)

    def __reduce__(self) -> tuple[type["JobError"], tuple[list[str]]]:
        return JobError, (self.mistakes,)  # for pickling, between ranks


class InUseError(InputError):
    """The output directory is in use by another running program."""


class RunError(Exception):
    """A run that cannot continue, described in one sentence. The command line ends with exit code 1."""


class UnsolvedError(RunError):
    """A steady state that cannot be solved. `place` names its velocity, pressure and temperature, and `reason` says
    why."""

    def __init__(self, place: str, reason: str) -> None:
        super().__init__(f"{place}: {reason}")
        self.place, self.reason = place, reason

    def __reduce__(self) -> tuple[type["UnsolvedError"], tuple[str, str]]:
        return UnsolvedError, (self.place, self.reason)  # for pickling, between ranks


NO_NUMBERS: Mapping[str, object] = {}


@dataclass(frozen=True)
class Doubt:
    """A warning: its `kind`, its `place` (such as a key of the job), and its `sentence`, with places for the `numbers`
    (SI units) and names."""

    kind: str
    place: str
    numbers: Mapping[str, object]
    sentence: str

    @property
    def body(self) -> str:
        """Return the sentence without the place."""
        return FORMATTER.vformat(self.sentence, (), self.numbers)

    def __str__(self) -> str:
        return f"{self.place}: {self.body}" if self.place else self.body

    @property
    def subject(self) -> tuple[str, ...]:
        """Return kind, place and names except `where`: warnings with the same subject differ only in numbers."""
        names = (value for name, value in self.numbers.items() if isinstance(value, str) and name != "where")
        return self.kind, self.place, *names


@dataclass(frozen=True)
class Kind:
    """A kind of warning: its name, and its sentence with places for numbers. Calling it returns a `Doubt`."""

    name: str
    sentence: str

    def __call__(self, place: str = "", numbers: Mapping[str, object] = NO_NUMBERS) -> Doubt:
        return Doubt(self.name, place, numbers, self.sentence)


# first warning of each subject, and the numbers of its cases
Kinds = dict[tuple[str, ...], tuple[Doubt, list[int]]]


class SweepWarnings:
    """Warnings of a sweep by subject. Subjects of the warnings `shown` before are not shown again. Other subjects are
    shown immediately if `at_once` is True, else at the end."""

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
        """Return the messages at the end: warnings that were not yet shown, or that several cases share. `of_groups` is
        a list of the `kinds` of all groups of ranks."""
        whole: Kinds = {}
        for kinds in of_groups:
            for subject, (doubt, cases) in kinds.items():
                whole.setdefault(subject, (doubt, []))[1].extend(cases)
        found = [(doubt, sorted(cases)) for doubt, cases in whole.values() if len(cases) > 1 or not self._at_once]
        return [f"{doubt} ({name_cases(cases)})" for doubt, cases in found]


class ParcontactWarning(UserWarning):
    """A warning about a job or its results.

    `kind` names the problem, `place` the key of the job or `""`, and `numbers` has the values of the sentence in SI
    units. For Python's filters two warnings are the same if they differ only in `numbers`: if a line of a script calls
    this package many times, each problem is shown once.
    """

    def __init__(self, doubt: Doubt) -> None:
        super().__init__(doubt)
        self.kind: str = doubt.kind
        self.place: str = doubt.place
        self.numbers: Mapping[str, object] = doubt.numbers

    def __str__(self) -> str:
        return _WarningText(self.args[0])


class _WarningText(str):
    """The sentence of a warning, equal to every other one with the same subject, as Python's filters compare texts."""

    subject: tuple[str, ...]

    def __new__(cls, doubt: Doubt) -> "_WarningText":
        text = super().__new__(cls, doubt)
        text.subject = doubt.subject
        return text

    def __eq__(self, other: object) -> bool:
        return self.subject == other.subject if isinstance(other, _WarningText) else super().__eq__(other)

    def __hash__(self) -> int:
        return hash(self.subject)


class _Formatter(string.Formatter):
    """Formats like `str.format`, and with `!p` (a share in per cent), `!m` and `!M` (a length with its unit in four and
    three digits), `!t` (a multiple), and `!u` and `!d` (a number that is rounded up or down, so that a job that follows
    the advice keeps the limit)."""

    def convert_field(self, value: Any, conversion: Any) -> Any:
        if conversion == "p":
            return per_cent(value)
        if conversion == "t":
            return f"{value:.3g} times" if math.isfinite(value) else "far above"
        if conversion in ("u", "d"):
            return (rounded_up if conversion == "u" else rounded_down)(value)
        if conversion in ("m", "M"):
            return quantity(value, "m", 4 if conversion == "m" else 3)
        return super().convert_field(value, conversion)


FORMATTER = _Formatter()
SAID = Kind("said", "{text}")  # whole sentences, from plug-ins and from tables of measured moduli
