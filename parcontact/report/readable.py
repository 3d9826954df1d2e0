"""What a report may read: regular files that the owner of the output directory may read, and no links.

A report can be read by people who may not read what it is made of. A link in a directory that somebody else has filled,
or a file that its job names, would otherwise publish what only the one who makes the report may read.
"""

import grp
import os
import pwd
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..job.text import yamltext
from ..storage import hdf5

READ = (  # in an output directory, each before what is below it
    *("*.csv", "*.h5", "*.yaml", "*.png", "*.log", "study.txt", "checkpoint", "checkpoint/*.h5"),
    *("cases", "cases/*", "cases/*/*.csv", "cases/*/*.yaml"),
)
NAMING = ("path", "spectrum", "include")  # keys whose values are files


def refuse_others(directory: Path) -> None:
    """Raise InputError where a report of a directory would read a link, or what its owner may not read."""
    try:
        owner = directory.stat().st_uid
        for path in (path for pattern in READ for path in sorted(directory.glob(pattern))):
            found = path.lstat()
            if not stat.S_ISREG(found.st_mode) and not stat.S_ISDIR(found.st_mode):
                kind = "a symbolic link" if stat.S_ISLNK(found.st_mode) else "no regular file"
                raise InputError(f"{path} is {kind}, which a report does not read; put the file itself in its place")
            _refuse(path, directory, owner)
        for job in (*directory.glob("*.resolved.yaml"), *directory.glob("cases/*/*.resolved.yaml")):
            for path in _named(job):
                _refuse(path, directory, owner)
    except OSError as error:
        raise InputError(f"{directory} cannot be read: {hdf5.reason(error)}") from error


def _named(job: Path) -> Iterator[Path]:
    """The files that the surface and the material of a job name, and that are there."""
    data = yamltext.parse(job.read_bytes(), str(job)).data
    for section in (data.get("surface"), data.get("material")) if isinstance(data, dict) else ():
        for part in section if isinstance(section, list) else [section]:
            for value in _values(part):
                if os.path.lexists(path := job.parent / value):
                    yield path


def _values(part: Any) -> Iterator[str]:
    """Texts of the keys in NAMING, in a part of a job and in what it holds."""
    for key, value in part.items() if isinstance(part, dict) else ():
        if key in NAMING and isinstance(value, str) and "\0" not in value:
            yield value
        yield from _values(value)


def _refuse(path: Path, directory: Path, owner: int) -> None:
    if not may_read(path, owner):
        raise InputError(f"{path} may not be read by the owner of {directory}, {_name(owner)}: it is not for a report")


def may_read(path: Path, user: int) -> bool:
    """Whether the modes of a file and of the directories above it let a user, given by number, read it.

    Raises OSError. Of the user of this process the system itself knows more.
    """
    if user in (0, os.geteuid()):
        return True
    found = path.resolve()
    groups = _groups(user)
    within = all(_allows(parent, user, groups, stat.S_IXOTH) for parent in found.parents)
    return within and _allows(found, user, groups, stat.S_IROTH)


def _allows(path: Path, user: int, groups: set[int], right: int) -> bool:
    """Whether a user has a right, given as the bit of others."""
    found = path.stat()
    shift = 6 if found.st_uid == user else 3 if found.st_gid in groups else 0
    return bool(found.st_mode & right << shift)


def _groups(user: int) -> set[int]:
    try:
        known = pwd.getpwuid(user)
    except KeyError:
        return set()
    return {known.pw_gid, *(group.gr_gid for group in grp.getgrall() if known.pw_name in group.gr_mem)}


def _name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"
