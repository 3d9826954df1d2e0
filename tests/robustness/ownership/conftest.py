"""The command line where a job is, and what happens while it runs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from parcontact import __main__
from parcontact.march.loop import March

from .jobs import Main, write_job


@pytest.fixture
def main(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Main:
    """The command line in this process and in `tmp_path`, where job.yaml is: exit code, all that it says."""
    monkeypatch.chdir(tmp_path)
    write_job(tmp_path / "job.yaml")

    def run(*words: str) -> tuple[int, str]:
        capsys.readouterr()
        code = __main__.main([*words, "--quiet"] if words[0] not in ("info", "plot") else words)
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return code, said.out + said.err

    return run


@pytest.fixture
def at_step(monkeypatch: pytest.MonkeyPatch) -> Callable[[int, Callable[[], Any]], None]:
    """`at_step(n, act)`: something happens while a run makes its step n."""

    def disturb(number: int, act: Callable[[], Any]) -> None:
        advance = March.advance

        def advanced(self: March, step: Any) -> Any:
            row = advance(self, step)
            if step.number == number:
                act()
            return row

        monkeypatch.setattr(March, "advance", advanced)

    return disturb
