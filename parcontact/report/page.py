"""The page: all chapters in one HTML file that loads nothing from elsewhere."""

import re
import stat
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from .. import progress
from ..errors import InputError
from ..storage import files, hdf5
from ..storage.provenance import PROGRAM
from .chapters import compare_directories, describe_directory

NAME, TEMPLATE = "report.html", "page.html.jinja"
LONG_WORD = re.compile(r"\S{14,}")  # does not fit a column of a phone
SMALL_NUMBER = re.compile(r"-?\d[\d.]*e-\d+")
BREAKS = re.compile(r"(?<=[_./,=:])(?=\w)")  # where a long word may go on in the next line
NUMBER = re.compile(r"(?<=\d) (?=±|%|°C|(?:[nµmkMG]?(?:Pa|N|m|s|J|Hz)|h|min|days|years)\b)|(?<=±) |(?<==) (?=[\d-])")


def write_report(directories: Sequence[Path], out: Path | None = None) -> Path:
    """Write the report of these output directories; returns its path: report.html in the first, unless `out` is given.

    Raises InputError for a directory without results, and for a file that cannot be written.
    """
    target = out or directories[0] / NAME
    if target.suffix not in (".html", ".htm"):
        raise InputError(f"--out must end in .html, got {str(target)!r}")
    for directory in directories:
        if not directory.is_dir():
            raise InputError(f"{directory} is no directory")
        _refuse_links(directory)
    text = render(directories)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(target, files.is_marked) as file:
            file.write(text.encode(errors="backslashreplace"))
    except OSError as error:
        raise InputError(f"{target} cannot be written: {hdf5.reason(error)}") from error
    return target


def _refuse_links(directory: Path) -> None:
    """Raise InputError for what a report would read that is no file of the directory: it would publish another one."""
    for path in (path for pattern in ("*", "checkpoint/*", "cases/*", "cases/*/*") for path in directory.glob(pattern)):
        kind = path.lstat().st_mode
        if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
            told = "a symbolic link" if stat.S_ISLNK(kind) else "no regular file"
            raise InputError(f"{path} is {told}, which a report does not read; put the file itself in its place")


def render(directories: Sequence[Path]) -> str:
    each = [describe_directory(directory) for directory in progress.with_bar(directories, "chapters", "chapter")]
    chapters = [*compare_directories(directories), *each]
    loader = PackageLoader("parcontact", "report")
    shown = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    shown.filters |= {"breakable": breakable, "whole_numbers": whole_numbers}
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return shown.get_template(TEMPLATE).render(chapters=chapters, program=PROGRAM, made=made, mark=files.MARK)


def breakable(text: str, mark: str = "<wbr>") -> Markup:
    """Return a text whose long words, as names of columns and paths, may break after their parts and nowhere else; a
    browser would break 1e-05 at its hyphen."""
    parts = LONG_WORD.sub(lambda word: BREAKS.sub(mark, word[0]), str(escape(text)))
    return Markup(SMALL_NUMBER.sub(r'<span class="n">\g<0></span>', parts))


def whole_numbers(text: str) -> str:
    """Return a sentence in which no line ends between a number, its error and its unit."""
    return NUMBER.sub("\N{NO-BREAK SPACE}", text)
