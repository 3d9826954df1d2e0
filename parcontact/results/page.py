"""The HTML page of a report, which loads no other files."""

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
LONG_WORD = re.compile(r"\S{14,}")  # word that is wider than a column on a phone
SMALL_NUMBER = re.compile(r"-?\d[\d.]*e-\d+")
BREAKS = re.compile(r"(?<=[_./,=:])(?=\w)")  # positions at which a long word may be broken
NUMBER = re.compile(r"(?<=\d) (?=±|%|°C|(?:[nµmkMG]?(?:Pa|N|m|s|J|Hz)|h|min|days|years)\b)|(?<=±) |(?<==) (?=[\d-])")


def write_report(directories: Sequence[Path], out: Path | None = None) -> Path:
    """Write the report of output directories, and return its path (default: report.html in the first one).

    Raises InputError for a directory without results, and for a file that cannot be written.
    """
    target = out or directories[0] / NAME
    if target.suffix not in (".html", ".htm"):
        raise InputError(f"--out must end in .html, got {str(target)!r}")
    for directory in directories:
        if not directory.is_dir():
            raise InputError(f"{directory} is not a directory")
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
    """Raise InputError for links in a directory, which would publish files from elsewhere."""
    for path in (path for pattern in ("*", "checkpoint/*", "cases/*", "cases/*/*") for path in directory.glob(pattern)):
        kind = path.lstat().st_mode
        if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
            kind_name = "a symbolic link" if stat.S_ISLNK(kind) else "not a regular file"
            raise InputError(f"{path} is {kind_name}, which a report does not read; replace it by the file itself")


def render(directories: Sequence[Path]) -> str:
    each = [describe_directory(directory) for directory in progress.with_bar(directories, "chapters", "chapter")]
    chapters = [*compare_directories(directories), *each]
    loader = PackageLoader("parcontact", "results")
    shown = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    shown.filters |= {"breakable": breakable, "whole_numbers": whole_numbers}
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return shown.get_template(TEMPLATE).render(chapters=chapters, program=PROGRAM, made=made, mark=files.MARK)


def breakable(text: str, mark: str = "<wbr>") -> Markup:
    """Return a text whose long words may be broken after `_./,=:` only; browsers would break 1e-05 at its hyphen."""
    parts = LONG_WORD.sub(lambda word: BREAKS.sub(mark, word[0]), str(escape(text)))
    return Markup(SMALL_NUMBER.sub(r'<span class="n">\g<0></span>', parts))


def whole_numbers(text: str) -> str:
    """Return a sentence without line breaks between a number, its error and its unit."""
    return NUMBER.sub("\N{NO-BREAK SPACE}", text)
