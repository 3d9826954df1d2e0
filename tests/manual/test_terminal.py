"""Pages in a terminal of 80 letters: no prose is wider, code is as it was, no word is lost."""

import re

import pytest

from parcontact.manual import terminal, texts

TABLES = re.compile(r"^[|\s:-]+$|[|;]", re.MULTILINE)  # rules and marks of tables, and of the web site


@pytest.mark.parametrize("name", texts.names())
def test_prose_is_not_wider(name: str) -> None:
    text = texts.plain(name, {"verbs": lambda: ""})
    prose = terminal.CODE.sub("", text)
    wide = [line for line in prose.splitlines() if len(line) > 80 and not line.startswith(("#", "!["))]
    assert not [line for line in wide if " " in line.strip()]


@pytest.mark.parametrize("name", texts.names())
def test_no_word_is_lost(name: str) -> None:
    text = texts.FENCE.sub("", texts.page(name, {"verbs": lambda: ""}))
    found = terminal.wrapped(text, 80)
    assert terminal.CODE.findall(found) == terminal.CODE.findall(text)
    assert TABLES.sub(" ", found).split() == TABLES.sub(" ", text).split()


def test_lists_keys_and_tables() -> None:
    """Items hang, keys and examples keep their lines; a row of a wide table is its first cell and the others."""
    text = (
        "* one two three\n  four five\n\n`key`\n: what it means\n  Example: `key: 1`\n\n| a | b | c |\n|---|---|---|\n"
    )
    assert terminal.wrapped(f"{text}| row | one | two three |", 16).splitlines() == [
        "* one two three",
        "  four five",
        "",
        "`key`",
        ": what it means",
        "  Example: `key:",
        "  1`",
        "",
        "a",
        "    b; c",
        "row",
        "    one; two",
        "    three",
    ]
