"""Files that ask programs to stop."""

from dataclasses import dataclass
from pathlib import Path

NAME = "stop"  # in an output directory, or in that of a sweep

Identity = tuple[int, ...]


@dataclass(frozen=True)
class StopFile:
    """One for all programs that work on the same sweep, and so removed by none of them.

    It asks those that run when it is made or touched. One that was there `before` a program began asks nothing of it:
    it is what others have left.
    """

    path: Path
    before: Identity | None

    @classmethod
    def from_now_on(cls, path: Path) -> "StopFile":
        """One that asks if it is made, or touched, from now on."""
        return cls(path, _identity(path))

    @property
    def asks(self) -> bool:
        """Whether to stop."""
        return _identity(self.path) not in (None, self.before)


def remove(path: Path) -> str:
    """Remove a stop file, also a directory of its name; returns why the next run would find it again, or ''."""
    try:
        if path.is_dir() and not path.is_symlink():
            path.rmdir()
        else:
            path.unlink(missing_ok=True)
    except OSError as error:
        return f"asked to stop by {path}, which cannot be removed: {error.strerror}; remove it"
    return ""


def _identity(path: Path) -> Identity | None:
    """What tells a file from one that was there before, and changes when it is touched; None where there is none."""
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns, found.st_ctime_ns
