"""Stop files: files that make running programs stop."""

import os
import secrets
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

NAME = "stop"  # name of the stop file in the output directory of a run or a sweep


@dataclass(frozen=True)
class StopFile:
    """A stop file shared by all programs of a sweep, which none of them removes.

    It stops programs that run when it is created or touched; a file of time `before` [ns] has no effect. By a second
    file, `own`, the ranks of one program stop each other.
    """

    path: Path
    before: int
    own: Path

    @classmethod
    def from_now_on(cls, path: Path) -> "StopFile":
        """Return a stop file that has an effect if it is created or touched after this call."""
        return cls(path, _touched(path), path.with_name(f".{path.name}-{secrets.token_hex(8)}"))

    @property
    def asks(self) -> bool:
        return self.own.exists() or _touched(self.path) not in (0, self.before)

    def ask_own(self) -> None:
        """Stop the other ranks of this program; if the file cannot be written, they end with their cases."""
        with suppress(OSError):
            self.own.touch()

    def forget_own(self) -> None:
        """Remove the file `own`, after all ranks have ended."""
        with suppress(OSError):
            self.own.unlink(missing_ok=True)


def remove(path: Path) -> str:
    """Remove a stop file; returns a message if this fails, or ''."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        return f"stopped by {path}, which cannot be removed: {os.strerror(error.errno or 0)}; remove it"
    return ""


def _touched(path: Path) -> int:
    """Return the time of the last change of a file [ns], 0 without a file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
