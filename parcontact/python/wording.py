"""Advice in errors for Python users: arguments and keys instead of options of the command line."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import InputError, JobError, RunError

NO_SWEEP = 'set={"sweep": None}'
WORDS = {  # patterns and their replacements, applied in this order
    r"choose one of them \(--case\) or leave it out \(--set sweep=null\)": f"leave it out ({NO_SWEEP})",
    r"change the sweep instead, like --set '.*'": f"leave the sweep out ({NO_SWEEP})",
    r"--set (\w+)=\{include: (.*?)\}": r'set={"\1": {"include": "\2"}}',
    r"--restart never": 'restart="never"',
    r"--restart PATH": "restart=PATH",
    r"give --out for another directory": "give another output.directory",
    r"--out\b": "output.directory",
    r"--velocities first:last:count": "velocities",
    r"--pressures": "pressures",
}


@contextmanager
def python_words() -> Iterator[None]:
    """Reword errors raised within the context for Python users."""
    try:
        yield
    except (InputError, RunError) as error:
        error.args = tuple(_worded(text) if isinstance(text, str) else text for text in error.args)
        if isinstance(error, JobError):
            error.mistakes = [_worded(text) for text in error.mistakes]
        raise


def _worded(text: str) -> str:
    for pattern, words in WORDS.items():
        text = re.sub(pattern, words, text)
    return text
