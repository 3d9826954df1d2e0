"""The page: all chapters in one HTML file that loads nothing from elsewhere."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from .. import progress
from ..errors import InputError
from ..storage import files, hdf5
from ..storage.provenance import PROGRAM
from . import readable
from .chapters import chapter, together

NAME, TEMPLATE = "report.html", "page.html.jinja"


def write(directories: Sequence[Path], out: Path | None = None) -> Path:
    """Write the report of these output directories; returns its path: report.html in the first, unless `out` is given.

    Raises InputError for a directory without results, and for a file that cannot be written.
    """
    for directory in directories:
        if not directory.is_dir():
            raise InputError(f"{directory} is no directory")
        readable.refuse_others(directory)
    target = out or directories[0] / NAME
    if target.suffix not in (".html", ".htm"):
        raise InputError(f"--out must end in .html, got {str(target)!r}")
    text = render(directories)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(target, files.is_marked) as file:
            file.write(text.encode(errors="backslashreplace"))
    except OSError as error:
        raise InputError(f"{target} cannot be written: {hdf5.reason(error)}") from error
    return target


def render(directories: Sequence[Path]) -> str:
    """The text of the page."""
    each = [chapter(directory) for directory in progress.shown(directories, "chapters", "chapter")]
    chapters = [*together(directories), *each]
    loader = PackageLoader("parcontact", "report")
    shown = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return shown.get_template(TEMPLATE).render(chapters=chapters, program=PROGRAM, made=made, mark=files.MARK)
