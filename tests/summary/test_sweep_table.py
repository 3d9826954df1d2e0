"""A damaged sweep.csv is told in a sentence, by all that read it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from parcontact.errors import InputError
from parcontact.plotting import sweep
from parcontact.report import results
from parcontact.summary import info

HEAD = "case,a.velocity,state,mu_max\n"
DAMAGED = {
    "empty": "",
    "no state": "case,a.velocity,mu_max\n0,1.0,0.1\n",
    "cut": f"{HEAD}0,1.0,done,0.1\n1,2.0",
    "no case": f"{HEAD}x,1.0,done,0.1\n",
    "cut number": f"{HEAD}0,1.0,done,0.1\n1,2.0,done,0.01",
    "few values": f"{HEAD}0,1.0,done\n",
    "no number": f"{HEAD}0,1.0,done,0.1\n1,2.0,done,O.1\n",
    "zeros": "\0" * 99,
}


@pytest.mark.parametrize("name", DAMAGED)
@pytest.mark.parametrize("read", [sweep.charts, results.describe_sweep])
def test_what_is_no_table(tmp_path: Path, name: str, read: Callable[[Path], object]) -> None:
    (tmp_path / "sweep.csv").write_text(DAMAGED[name])
    with pytest.raises(InputError, match=r"sweep.csv cannot be read: .*; run the sweep again"):
        read(tmp_path)
    told, sound = info.describe(tmp_path)
    assert not sound
    assert str(tmp_path / "sweep.csv") in told
