"""Errors that a user can put right."""

from collections.abc import Sequence


class InputError(Exception):
    """Bad input, said in one sentence: the program ends with exit code 2 and writes nothing."""


class JobError(InputError):
    """A job that cannot be run; `mistakes` are sentences, each beginning with file:line:column or the name of a key."""

    def __init__(self, mistakes: Sequence[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = list(mistakes)

    def __reduce__(self) -> tuple[type["JobError"], tuple[list[str]]]:
        return JobError, (self.mistakes,)  # as it travels between ranks


class InUseError(InputError):
    """The output directory is that of another program that runs now."""


class RunError(Exception):
    """A run that cannot go on, said in one sentence: exit code 1."""
