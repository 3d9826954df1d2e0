"""Text of the manual for a terminal: paragraphs, lists and tables within its width, code as it is."""

import re
import textwrap
from collections.abc import Iterator
from itertools import groupby

CODE = re.compile(r"^(```.*?^```$|\$\$.*?\$\$[ ,.]*$)", re.MULTILINE | re.DOTALL)
ITEM = re.compile(r"^(\s*(?:\* |: |\d+\. )?)")  # what the first line of a paragraph begins with
BEGINS = re.compile(r"^\s*(?:\* |: |\d+\. |#|!\[)|^  Example: |^`[^`]+`$")  # lines that go on no paragraph
RULE = re.compile(r"^[|\s:-]+$")  # below the head of a table


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
    """Yield a table as it is where it fits, else its rows as paragraphs: the first cell, then the others."""
    if max(map(len, lines)) <= width:
        yield from lines
        return
    for line in lines:
        if not RULE.match(line):
            first, *others = (cell.strip() for cell in line.strip("|").split("|"))
            yield from _fill(first, width, "", "")
            yield from _fill("; ".join(filter(None, others)), width, "    ", "    ")


def _fill(text: str, width: int, first: str, hanging: str) -> list[str]:
    return textwrap.wrap(
        text, width, initial_indent=first, subsequent_indent=hanging, break_long_words=False, break_on_hyphens=False
    )
