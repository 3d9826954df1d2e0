"""Pages of the manual as text for a terminal, with the parts that the program writes into them.

A line `% written here: NAME` in a page is replaced by text that the program makes, so that it is always up to date: the
keys of a job (`reference.keys`), the columns of tables (`columns.TABLES`), and texts of the caller, such as the options
of the verbs.

The page on Python is made from docstrings, by the same directives from which Sphinx makes the page of the web site: `..
autoclass:: NAME`, `:members:`, `.. autofunction:: NAME`. The reference of the keys of a job is made from the types.
Paragraphs, lists and tables fit the width of the terminal; code stays as it is.
"""

from __future__ import annotations

import difflib
import inspect
import pydoc
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import is_dataclass
from functools import cache, partial
from itertools import groupby
from pathlib import Path
from typing import Any

import yaml

from ..columns import TABLES, describe_columns
from ..errors import InputError
from ..job import model
from ..job.model import Key, SectionSchema
from ..job.parts import kind_key

ROOM = 64  # letters for the first sentence of a docstring in the list of names
BLOCK = re.compile(r"^```\{eval-rst\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r"^\.\. auto(?:class|function):: (\S+)\n(?:   :members:(.*)\n)?", re.MULTILINE)


def written(page: str) -> str:
    """Return the Markdown of a page in which headings and docstrings replace the directives of Sphinx (see the
    module)."""
    return BLOCK.sub(lambda block: "\n\n".join(_entries(block.group(1))), page)


def _entries(block: str) -> Iterator[str]:
    named = DIRECTIVE.findall(block)
    width = max(len(_short(name)) for name, _ in named)
    yield "```text\n" + "\n".join(f"{_short(name):{width}}  {_first_sentence(name)}" for name, _ in named) + "\n```"
    for name, members in named:
        found: Any = pydoc.locate(name)
        yield f"## {_short(name)}{_parameters(found)}\n\n{inspect.getdoc(found)}"
        named = [member.strip() for member in members.split(",") if member.strip()]
        if not named and members == "" and f"{name}\n   :members:" in block:
            named = [name for name, value in vars(found).items() if not name.startswith("_") and inspect.getdoc(value)]
        for member in named:
            value = inspect.getattr_static(found, member)
            yield f"### {member}{_parameters(getattr(value, '__func__', value))}\n\n{inspect.getdoc(value)}"


def _short(name: str) -> str:
    """Return a name as a program writes it: `pc.steady`."""
    return name.replace("parcontact.", "pc.", 1)


def _first_sentence(name: str) -> str:
    """Return the beginning of a docstring, as far as a line of a terminal has room for it."""
    text = re.split(r"(?<=[.:;]) ", " ".join((inspect.getdoc(pydoc.locate(name)) or "").split()))[0]
    return textwrap.shorten(text.rstrip(".:;"), ROOM, placeholder=" ...")


def _parameters(found: Any) -> str:
    """Return parameters as in a call: `(job, set=None)`; '' of attributes, results and errors, which nobody calls."""
    if not callable(found) or is_dataclass(found) or (isinstance(found, type) and issubclass(found, Exception)):
        return ""
    signature = inspect.signature(found)
    plain = [
        parameter.replace(annotation=parameter.empty)
        for name, parameter in signature.parameters.items()
        if name not in ("self", "cls")
    ]
    return str(signature.replace(parameters=plain, return_annotation=signature.empty))


MEANINGS = Path(__file__).parent / "manual" / "keys.yaml"


@cache
def meanings() -> dict[str, dict[str, Any]]:
    """Return the meaning and an example of each key of a job: a mapping from the name of a section's class to a mapping
    from its keys to `[meaning, example]`."""
    found: dict[str, dict[str, Any]] = yaml.safe_load(MEANINGS.read_text(encoding="utf-8"))
    return found


def keys() -> str:
    """Return all sections of a job and their keys, as Markdown."""
    return "\n".join(line for section in model.sections() for line in _section(section))


def heading(section: SectionSchema) -> str:
    """Return the heading of a section: its place in a job, and its kind (such as `shape: sphere`) if the job has a
    choice of kinds there."""
    kind = kind_key(section.part)
    named = f"{kind}: {section.part.model_fields[kind].default}" if kind else ""
    more = section.part.label.removeprefix(named.replace(":", "")).strip()
    detail = f" {more}" if named and more else f": {more}" if more not in ("", section.place) else ""
    place = f"`{section.place}`, `{named}`" if named else f"`{section.place}`"
    return f"{place}{detail}" if section.place else "The sections of a job"


def _section(section: SectionSchema) -> Iterator[str]:
    yield f"\n## {heading(section)}\n"
    yield f"{' '.join((section.part.__doc__ or '').split())}\n"
    for word in section.part.one_of:
        yield f"Exactly one of {_words(word)} is given.\n"
    for word in section.part.at_most_one:
        yield f"At most one of {_words(word)} is given.\n"
    known = meanings().get(section.part.__name__, {})
    for key in section.keys:
        yield from _key(key, *known.get(key.word, ("", "")))


def _key(key: Key, meaning: str, example: str) -> Iterator[str]:
    facts = [f"Must be {key.must_be}"]
    facts += [f"range: {key.within}"] if key.within else []
    facts += [f"unit: {key.unit}"] if key.unit not in ("", "-") else []
    facts.append("required" if key.required else f"default: `{key.default}`" if key.default else "optional")
    yield f"`{key.word}`\n: {meaning} *{'; '.join(facts)}.*"
    yield f"  Example: `{key.word}: {example}`\n" if example != "" else ""


def _words(words: tuple[str, ...]) -> str:
    return ", ".join(f"`{word}`" for word in words)


CODE = re.compile(r"^(```.*?^```$|\$\$.*?\$\$[ ,.]*$)", re.MULTILINE | re.DOTALL)
ITEM = re.compile(r"^(\s*(?:\* |: |\d+\. )?)")  # what the first line of a paragraph begins with
BEGINS = re.compile(r"^\s*(?:\* |: |\d+\. |#|!\[)|^  Example: |^`[^`]+`$")  # lines that go on no paragraph
RULE = re.compile(r"^\|[\s:-]*-[|\s:-]*$")  # below the head of a table
BAR = re.compile(r"(?<!\\)\|")  # between cells


def wrapped(text: str, width: int) -> str:
    """Return Markdown with lines of at most `width` letters; code, equations and longer words stay as they are."""
    parts = CODE.split(text)
    return "".join(part if number % 2 else "\n".join(_lines(part, width)) for number, part in enumerate(parts))


def _lines(text: str, width: int) -> Iterator[str]:
    for is_table, group in groupby(text.split("\n"), lambda line: line.startswith("|")):
        lines = list(group)
        yield from _table(lines, width) if is_table else _prose(lines, width)


def _prose(lines: list[str], width: int) -> Iterator[str]:
    paragraph: list[str] = []
    for line in lines:
        if paragraph and (not line.strip() or BEGINS.match(line)):
            yield from _paragraph(paragraph, width)
            paragraph = []
        if line.strip():
            paragraph.append(line)
        else:
            yield ""
    yield from _paragraph(paragraph, width)


def _paragraph(lines: list[str], width: int) -> list[str]:
    text = " ".join([*lines[:1], *map(str.strip, lines[1:])])
    if text.startswith(("#", "![")):
        return [text]
    found = ITEM.match(text)
    return _fill(text, width, "", " " * len(found[1]) if found else "")


def _table(lines: list[str], width: int) -> Iterator[str]:
    """Yield a table with columns of even width where it fits, else a block for each row."""
    head, *rows = [_cells(line) for line in lines if not RULE.match(line)]
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    if sum(widths) + 2 * (len(widths) - 1) > width:
        for row in rows:
            yield from _block(head, row, width)
        return
    for cells in (head, ["-" * room for room in widths], *rows):
        yield "  ".join(cell.ljust(room) for cell, room in zip(cells, widths, strict=True)).rstrip()


def _cells(line: str) -> list[str]:
    return [cell.strip().replace("\\|", "|") for cell in BAR.split(line.strip())[1:-1]]


def _block(head: list[str], row: list[str], width: int) -> Iterator[str]:
    """Yield the first cell of a row as heading, then each other cell once, after the columns that have it."""
    yield ""
    yield from _fill(f"{head[0]}: {row[0]}" if head[0] else row[0], width, "", "  ")
    columns: dict[str, list[str]] = {}
    for name, cell in zip(head[1:], row[1:], strict=True):
        if cell:
            columns.setdefault(cell, []).append(name)
    for cell, names in columns.items():
        named = ", ".join(filter(None, names))
        yield from _fill(f"{named}: {cell}" if named else cell, width, "  ", "    ")


def _fill(text: str, width: int, first: str, hanging: str) -> list[str]:
    return textwrap.wrap(
        text, width, initial_indent=first, subsequent_indent=hanging, break_long_words=False, break_on_hyphens=False
    )


PAGES = Path(__file__).parent / "manual" / "pages"
MARK = re.compile(r"^% written here: (\w+)$", re.MULTILINE)
FENCE = re.compile(r"^:::\{toctree\}\n.*?^:::\n|^:::.*\n", re.MULTILINE | re.DOTALL)
Writers = Mapping[str, Callable[[], str]]
OURS: Writers = {"keys": keys, **{Path(file).stem: partial(describe_columns, table) for file, table in TABLES.items()}}


def page_names() -> list[str]:
    """Return the names of the pages, in the order of the table of contents."""
    listed = re.findall(r"^([a-z_]+)$", (PAGES / "index.md").read_text(encoding="utf-8"), re.MULTILINE)
    return ["index", *listed]


def page_title(name: str) -> str:
    """Return the heading of a page."""
    found = re.search(r"^# (.+)$", (PAGES / f"{name}.md").read_text(encoding="utf-8"), re.MULTILINE)
    return found.group(1) if found else name


def page(name: str, writers: Writers | None = None) -> str:
    """Return a page in full, as MyST Markdown. Raises InputError for an unknown name."""
    if name not in page_names():
        close = difflib.get_close_matches(name, page_names(), n=1)
        hint = f"; did you mean {close[0]}?" if close else f"; there are {', '.join(page_names())}"
        raise InputError(f"the manual has no page {name!r}{hint}")
    known = {**OURS, **(writers or {})}
    text = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    return MARK.sub(lambda found: known[found.group(1)](), text)


def plain_page(name: str, writers: Writers | None = None, width: int = 80) -> str:
    """Return a page for a terminal `width` letters wide, without the markup of the web site."""
    text = FENCE.sub("", written(page(name, writers)))
    text = re.sub(r"\{(?:doc|download)\}`(?:([^<`]+) <([^>`]+)>|([^`]+))`", _reference, text)
    text = re.sub(r"^\(.+\)=\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"^```\{(\w+)\}", r"```\1", text, flags=re.MULTILINE)
    return re.sub(r"\n{3,}", "\n\n", wrapped(text, width))


def _reference(found: re.Match[str]) -> str:
    words, target, alone = found.groups()
    return f"{words} (parcontact manual {target})" if target else f"`parcontact manual {alone}`"


def contents() -> str:
    width = max(map(len, page_names()))
    lines = [f"  {name:<{width}}  {page_title(name)}" for name in page_names()]
    return "\n".join(["parcontact manual PAGE prints a page:", "", *lines])
