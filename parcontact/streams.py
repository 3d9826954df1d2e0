"""Output streams that never fail, as printing must not end the program, and bars of progress on terminals."""

import io
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, TextIO, TypeVar

PLAIN = str.maketrans({"±": "+-", "µ": "u", "²": "^2", "³": "^3", "°": "deg ", "−": "-", "–": "-", "×": "x"})
CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def printable(text: str) -> str:
    """Return the text with control characters, and characters that reverse the direction of text, replaced by their
    codes."""
    return CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}" if ord(found[0]) > 255 else repr(found[0])[1:-1], text)


class TolerantStream(io.TextIOBase):
    """A stream that writes to another stream. It drops text if the other stream is closed or full, and replaces
    characters that the other stream cannot encode.

    If `plain` is True, control characters except tabs and ends of lines are replaced, too; a progress bar needs them.
    """

    def __init__(self, stream: TextIO | None, plain: bool) -> None:
        self._stream, self._plain, self.gone = stream, plain, False
        self.lost = "" if stream else "it is closed"  # why text was lost, except to a closed pipe

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        shown = printable(text) if self._plain else text
        if self._stream is not None and not self.gone:
            try:
                self._stream.write(shown)
            except UnicodeEncodeError:
                self._stream.write(shown.translate(PLAIN).encode("ascii", "backslashreplace").decode())
            except (OSError, ValueError) as error:
                self._give_up(error)
        return len(text)

    def flush(self) -> None:
        if self._stream is not None and not self.gone:
            try:
                self._stream.flush()
            except (OSError, ValueError) as error:
                self._give_up(error)

    def _give_up(self, error: OSError | ValueError) -> None:
        self.gone = True
        if not isinstance(error, BrokenPipeError):
            self.lost = getattr(error, "strerror", None) or "it is closed"

    def isatty(self) -> bool:
        with suppress(OSError, ValueError):
            return self._stream is not None and not self.gone and self._stream.isatty()
        return False

    def drop_the_rest(self) -> None:
        """Drop unwritten text of a failed stream, so that Python does not fail when it ends."""
        self.flush()
        if self.gone and self._stream is not None:
            with suppress(OSError, ValueError):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, self._stream.fileno())
                os.close(nowhere)


@contextmanager
def tolerant_streams() -> Iterator[None]:
    """Make standard output and standard error tolerant within the context."""
    before = sys.stdout, sys.stderr
    out, err = TolerantStream(before[0], True), TolerantStream(before[1], False)
    sys.stdout, sys.stderr = out, err
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        out.drop_the_rest()
        err.drop_the_rest()


def describe_loss() -> str:
    """Return why printed text could not be written; '' if it was written, or if the reader closed the pipe."""
    sys.stdout.flush()
    return sys.stdout.lost if isinstance(sys.stdout, TolerantStream) else ""


T = TypeVar("T")


class Bar:
    """A progress bar below the printed lines, if standard error is a terminal."""

    def __init__(self, total: int, what: str, unit: str = "step", wanted: bool = True) -> None:
        self._bar = None
        if wanted and total and sys.stderr.isatty():
            from tqdm import tqdm  # slow to import

            self._bar = tqdm(total=total, desc=what, unit=unit, leave=False)

    def step(self) -> None:
        """Advance the bar by one."""
        if self._bar is not None:
            self._bar.update()

    def print(self, text: str) -> None:
        """Print a line above the bar."""
        if self._bar is not None:
            self._bar.write(text, file=sys.stdout)
        else:
            print(text, flush=True)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()


def with_bar(items: Sequence[T], what: str, unit: str = "step") -> Iterator[T]:
    """Yield the items, with a progress bar that counts the finished ones."""
    bar = Bar(len(items), what, unit)
    try:
        for item in items:
            yield item
            bar.step()
    finally:
        bar.close()
