"""Files that ask programs to stop."""

import os
import secrets
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

NAME = "stop"  # in an output directory, or in that of a sweep


@dataclass(frozen=True)
class StopFile:
    """A file for all programs that work on the same sweep, and so removed by none of them.

    It asks those that run when it is made or touched; one that was there `before`, last touched at that time [ns], asks
    nothing. By a second file, `own`, whose name no other program knows, the ranks of one program ask each other.
    """

    path: Path
    before: int
    own: Path

    @classmethod
    def from_now_on(cls, path: Path) -> "StopFile":
        """Return one that asks if it is made, or touched, from now on."""
        return cls(path, _touched(path), path.with_name(f".{path.name}-{secrets.token_hex(8)}"))

    @property
    def asks(self) -> bool:
        return self.own.exists() or _touched(self.path) not in (0, self.before)

    def ask_own(self) -> None:
        """Stop the other ranks of this program; where that cannot be written, they end with their cases."""
        with suppress(OSError):
            self.own.touch()

    def forget_own(self) -> None:
        """Remove the file by which the ranks of this program asked each other, once all of them have ended."""
        with suppress(OSError):
            self.own.unlink(missing_ok=True)


def remove(path: Path) -> str:
    """Remove a stop file; returns why the next run would find it again, or ''."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        return f"asked to stop by {path}, which cannot be removed: {os.strerror(error.errno or 0)}; remove it"
    return ""


def _touched(path: Path) -> int:
    """Return when a file was last touched [ns], 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
