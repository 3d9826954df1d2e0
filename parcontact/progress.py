"""Progress bars with the time left, on terminals only."""

import sys
from collections.abc import Iterator, Sequence
from typing import TypeVar

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
    """Yield the items, with a bar that counts the finished ones."""
    bar = Bar(len(items), what, unit)
    try:
        for item in items:
            yield item
            bar.step()
    finally:
        bar.close()
