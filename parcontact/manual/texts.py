"""Pages of the manual as text, with the parts that the program writes into them.

A line `% written here: NAME` in a page is replaced by text that the program makes, so that it is always up to date: the
keys of a job (`reference.keys`), the columns of tables (`columns.TABLES`), and texts of the caller, such as the options
of the verbs.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from ..columns import TABLES, describe_columns
from ..errors import InputError
from . import docstrings, reference, terminal

PAGES = Path(__file__).parent / "pages"
MARK = re.compile(r"^% written here: (\w+)$", re.MULTILINE)
FENCE = re.compile(r"^:::.*\n", re.MULTILINE)
Writers = Mapping[str, Callable[[], str]]
OURS: Writers = {
    "keys": reference.keys,
    **{Path(file).stem: partial(describe_columns, table) for file, table in TABLES.items()},
}


def page_names() -> list[str]:
    """Return the names of the pages, in the order of the table of contents."""
    listed = re.findall(r"^([a-z_]+)$", (PAGES / "index.md").read_text(encoding="utf-8"), re.MULTILINE)
    return ["index", *listed]


def page_title(name: str) -> str:
    """Return the heading of a page."""
    found = re.search(r"^# (.+)$", (PAGES / f"{name}.md").read_text(encoding="utf-8"), re.MULTILINE)
    return found.group(1) if found else name


def page(name: str, writers: Writers | None = None) -> str:
    """Return a page in full, as MyST Markdown. Raises InputError for a name that no page has."""
    if name not in page_names():
        close = difflib.get_close_matches(name, page_names(), n=1)
        hint = f"; did you mean {close[0]}?" if close else f"; there are {', '.join(page_names())}"
        raise InputError(f"the manual has no page {name!r}{hint}")
    known = {**OURS, **(writers or {})}
    text = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    return MARK.sub(lambda found: known[found.group(1)](), text)


def plain_page(name: str, writers: Writers | None = None, width: int = 80) -> str:
    """Return a page for a terminal `width` letters wide, without the marks of the web site."""
    text = FENCE.sub("", docstrings.written(page(name, writers)))
    text = re.sub(r"\{(?:doc|download)\}`(?:([^<`]+) <([^>`]+)>|([^`]+))`", _reference, text)
    text = re.sub(r"^\(.+\)=\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"^```\{(\w+)\}", r"```\1", text, flags=re.MULTILINE)
    return re.sub(r"\n{3,}", "\n\n", terminal.wrapped(text, width))


def _reference(found: re.Match[str]) -> str:
    words, target, alone = found.groups()
    return f"{words} (parcontact manual {target})" if target else f"`parcontact manual {alone}`"


def contents() -> str:
    width = max(map(len, page_names()))
    lines = [f"  {name:<{width}}  {page_title(name)}" for name in page_names()]
    return "\n".join(["parcontact manual PAGE prints a page:", "", *lines])
