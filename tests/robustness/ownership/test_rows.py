"""Rows of measures.csv that were edited, before a run or a plot."""

from collections.abc import Callable
from pathlib import Path

import pytest

from .jobs import BAD_INPUT, DONE, STEPS, Main, contents, steps


def change(line: int, act: Callable[[str], str]) -> Callable[[str], str]:
    def changed(text: str) -> str:
        lines = text.splitlines()
        lines[line - 1] = act(lines[line - 1])
        return "\n".join(lines) + "\n"

    return changed


EDITS: list[tuple[Callable[[str], str], str]] = [
    (change(4, lambda line: "abc" + line), "measures.csv, line 4: the step 'abc2' is not a whole number"),
    (change(4, lambda line: line + ",7"), "measures.csv, line 4, has "),
    (change(4, lambda line: line[:20].rsplit(",", 1)[0]), "measures.csv, line 4, has "),
    (change(1, lambda line: "a,b"), "measures.csv, line 1, does not name the columns"),
    (lambda text: text + "1,", ""),
    (lambda text: "", "measures.csv, line 1, does not name the columns"),
]


@pytest.mark.parametrize(("edit", "message"), EDITS)
def test_edited_rows(main: Main, tmp_path: Path, edit: Callable[[str], str], message: str) -> None:
    """A line that is none is named, and nothing changes; without an end it was never finished."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    path = tmp_path / "out" / "measures.csv"
    path.write_text(edit(path.read_text()))
    before = contents(tmp_path / "out")
    code, said = main("job.yaml", "--out", "out")
    if not message:
        assert (code, steps(tmp_path / "out")) == (DONE, list(range(STEPS + 1)))
        return
    assert code == BAD_INPUT
    assert message in said
    after = contents(tmp_path / "out")
    assert {name: after[name] for name in before if name != "job.resolved.yaml"} == {
        name: data for name, data in before.items() if name != "job.resolved.yaml"
    }


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (change(4, lambda line: line.replace(",", ",x", 1)), "measures.csv, line 4: time is 'x"),
        (change(4, lambda line: line + ",7"), "measures.csv, line 4, has "),
        (lambda text: "", "measures.csv is empty"),
    ],
)
def test_plot_of_edited_rows(main: Main, tmp_path: Path, edit: Callable[[str], str], message: str) -> None:
    """The line is named."""
    main("job.yaml", "--out", "out")
    path = tmp_path / "out" / "measures.csv"
    path.write_text(edit(path.read_text()))
    code, said = main("plot", "out")
    assert code == BAD_INPUT
    assert message in said


def test_missing_rows(main: Main, tmp_path: Path) -> None:
    """Told from what the checkpoint says of the table; the run goes on."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    path = tmp_path / "out" / "measures.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:3]))
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert "ends with step 1: the rows up to step " in said
