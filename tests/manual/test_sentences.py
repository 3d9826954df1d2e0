"""Sentences of README and of the manual are short: none is long, and their mean is that of prose that is read once."""

import re
from collections.abc import Iterator

import pytest
from marched_jobs import ROOT

from parcontact.door import manual_texts

MEAN, LONGEST = 14.0, 35  # words: of all pages together, and of any sentence
README_LONGEST = 25
NOT_PROSE = (
    r"^(```|\$\$).*?^(```|\$\$)$",  # code, output, equations
    r"^\$\$.*?\$\$[ ,.]*$",
    r"^(?:\||:::|% |!\[|\().*$",  # tables, marks of the web site, pictures
    r"^#.*$",
    r"^    .*$",
)
WORD = re.compile(r"\w")


def sentences(text: str) -> Iterator[str]:
    """Prose of Markdown by its sentences; an item of a list and what follows a colon count as one of their own."""
    for pattern in NOT_PROSE:
        text = re.sub(pattern, "\n\n", text, flags=re.MULTILINE | re.DOTALL if "*?" in pattern else re.MULTILINE)
    text = re.sub(r"`[^`]*`|\$[^$]*\$", "CODE", re.sub(r"\{\w+\}(?=`)", "", text))
    text = re.sub(r"^\s*(?:\*|>|\d+\.) ", "\n\n", text, flags=re.MULTILINE)
    for paragraph in re.split(r"\n\s*\n", text):
        yield from re.split(r"(?<=[.!?:])[*)\"]*\s+", " ".join(paragraph.split()))


def lengths(text: str) -> dict[str, int]:
    """Words of each sentence; fragments of one or two are none."""
    found = {each: sum(bool(WORD.search(word)) for word in each.split()) for each in sentences(text)}
    return {each: words for each, words in found.items() if words > 2}


@pytest.mark.parametrize("name", manual_texts.page_names())
def test_no_sentence_of_a_page_is_long(name: str) -> None:
    found = lengths((manual_texts.PAGES / f"{name}.md").read_text())
    assert {each: words for each, words in found.items() if words > LONGEST} == {}


@pytest.mark.parametrize("name", manual_texts.page_names())
def test_a_page_begins_with_what_the_reader_can_do(name: str) -> None:
    """Its first paragraph speaks to the reader; that of the first page to four of them."""
    first = (manual_texts.PAGES / f"{name}.md").read_text().split("\n\n")[1]
    assert re.search(r"\b(you|your|You)\b", first)


def test_the_mean_of_the_manual() -> None:
    words = [
        n
        for name in manual_texts.page_names()
        for n in lengths((manual_texts.PAGES / f"{name}.md").read_text()).values()
    ]
    assert len(words) > 500
    assert sum(words) / len(words) <= MEAN


def test_readme() -> None:
    found = lengths((ROOT / "README.md").read_text())
    assert {each: words for each, words in found.items() if words > README_LONGEST} == {}
    assert sum(found.values()) / len(found) <= MEAN


def test_how_sentences_are_counted() -> None:
    text = (
        "# A head\n\nOne two three four. Five `code is a word` six:\nseven eight nine.\n\n```sh\nno prose here\n```\n"
    )
    assert lengths(f"{text}\n* an item of five words\n\n| a | table of | words |\n") == {
        "One two three four.": 4,
        "Five CODE six:": 3,
        "seven eight nine.": 3,
        "an item of five words": 5,
    }
