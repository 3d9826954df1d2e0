"""A damaged sweep.csv is told in a sentence, by all that read it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from parcontact.errors import InputError
from parcontact.plotting import sweep
from parcontact.report import results
from parcontact.summary import info_directory

HEAD = "case,a.velocity,state,mu_max\n"
DAMAGED = {
    "empty": ("", "is damaged: its first line must name the columns of a sweep"),
    "no state": ("case,a.velocity,mu_max\n0,1.0,0.1\n", "is damaged: its first line must name"),
    "cut": (
        f"{HEAD}0,1.0,done,0.1\n1,2.0",
        "line 3: the number of a case and 3 values more were expected, got '1,2.0'",
    ),
    "no case": (f"{HEAD}x,1.0,done,0.1\n", "line 2: the number of a case and 3 values more were expected"),
    "cut number": (f"{HEAD}0,1.0,done,0.1\n1,2.0,done,0.01", "sweep.csv ends within line 3"),
    "cut names": (HEAD[:-4], "sweep.csv ends within line 1"),
    "no number": (f"{HEAD}0,1.0,done,0.1\n1,2.0,done,O.1\n", "line 3: mu_max is 'O.1', not a number"),
    "zeros": ("\0" * 99, "sweep.csv cannot be read: line contains NUL|is damaged"),
}


@pytest.mark.parametrize("name", DAMAGED)
@pytest.mark.parametrize("read", [sweep.charts, results.of_sweep])
def test_what_is_no_table(tmp_path: Path, name: str, read: Callable[[Path], object]) -> None:
    text, said = DAMAGED[name]
    (tmp_path / "sweep.csv").write_text(text)
    with pytest.raises(InputError, match=said):
        read(tmp_path)
    told, sound = info_directory.describe(tmp_path)
    assert not sound
    assert str(tmp_path / "sweep.csv") in told
