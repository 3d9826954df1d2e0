"""Errors that a user can correct."""

from collections.abc import Sequence


class InputError(Exception):
    """Bad input, described in one sentence: the program ends with exit code 2 and writes nothing."""


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
    """A run that cannot continue, described in one sentence: exit code 1."""


class UnsolvedError(RunError):
    """A steady state that cannot be solved: its `place` as text, and the `reason`."""

    def __init__(self, place: str, reason: str) -> None:
        super().__init__(f"{place}: {reason}")
        self.place, self.reason = place, reason

    def __reduce__(self) -> tuple[type["UnsolvedError"], tuple[str, str]]:
        return UnsolvedError, (self.place, self.reason)  # for pickling, between ranks
