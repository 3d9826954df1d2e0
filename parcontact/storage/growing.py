"""A table that grows line by line while others may read it, or remove it."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from . import files

PIECE = 1 << 20  # bytes copied at a time


class GrowingTable:
    """Whole lines under a line with names; a line that does not end in a newline is none."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        """Continue the file or begin it; raises OSError, and ValueError for what is no file of its own."""
        self.path = path
        self._handle = files.opened(path, os.O_RDWR | os.O_APPEND)
        self._size = os.fstat(self._handle).st_size
        if self._size == 0:
            self.append(names)

    def append(self, cells: Sequence[str]) -> None:
        """Add a line; on an error the file is as it was before."""
        line = ",".join(cells)
        rest = memoryview(f"{line}\n".encode())
        try:
            while rest:
                rest = rest[os.write(self._handle, rest) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._handle, self._size)
            raise
        self._size += len(line) + 1

    def sync(self) -> tuple[str, list[str]]:
        """Wait until all rows are on the disk. What others did to the file: rows that are lost, and what was mended."""
        os.fsync(self._handle)
        if os.fstat(self._handle).st_size < self._size:
            return f"{self.path} was cut short by another program during the run: rows are lost", []
        if files.is_the_file(self.path, self._handle):
            return "", []
        aside = files.put_aside(self.path)
        self._put_back()
        what = f"replaced by another file, which is now {aside.name}," if aside else "removed"
        return "", [f"{self.path} was {what} during the run: its rows were written again"]

    def close(self) -> None:
        with suppress(OSError):  # every row was written at once
            os.close(self._handle)

    def _put_back(self) -> None:
        """Write what the file held, which the system keeps as long as it is open, under its name again."""
        with files.replaced(self.path) as new:
            for start in range(0, self._size, PIECE):
                new.write(os.pread(self._handle, min(PIECE, self._size - start), start))
        handle = files.opened(self.path, os.O_RDWR | os.O_APPEND)
        os.close(self._handle)
        self._handle = handle
