"""Tables of moduli: both forms and all units mean the same, and what will not do is one sentence with its place."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.errors import InputError
from parcontact.rubber import tables

from . import measured

ROWS = [(0.1, 3.0, 0.3), (1.0, 3.6, 0.6), (10.0, 4.5, 0.9)]  # Hz, MPa, MPa: Young's moduli


def text(head: str, scale: tuple[float, ...] = (1.0, 1.0, 1.0), mark: str = ",") -> str:
    return "\n".join([head, *(mark.join(f"{v * s!r}" for v, s in zip(row, scale, strict=True)) for row in ROWS)]) + "\n"


SAME = {
    "pyvisco": text("f,E_stor,E_loss\nHz,MPa,MPa"),
    "semicolons": text("f;E_stor;E_loss\nHz;MPa;MPa", mark=";"),
    "brackets": text("f[Hz] E'[MPa] E''[MPa]", mark=" "),
    "spaced brackets": text("f [Hz], E' [MPa], E'' [MPa]"),
    "primes": text("f[Hz] E′[MPa] E″[MPa]", mark="\t"),
    "angular": text("omega[rad/s] E'[Pa] E''[kPa]", (2 * np.pi, 1e6, 1e3)),
    "shear": text("f[Hz] G'[MPa] G''[MPa]", (1.0, 1 / 3, 1 / 3)),
    "comments": "# a rubber\n\n" + text("f,E_stor,E_loss\nHz,GPa,GPa", (1.0, 1e-3, 1e-3)),
    "another order": text("f,E_stor,E_loss\nHz,MPa,MPa").replace("0.1,3.0,0.3\n", "") + "0.1,3.0,0.3\n",
    "a mark of byte order": "\ufeff" + text("f,E_stor,E_loss\nHz,MPa,MPa"),
}


@pytest.mark.parametrize("form", SAME)
def test_all_forms_mean_the_same(tmp_path: Path, form: str) -> None:
    """One set, of shear, in SI and by rising rate; nu = 1/2 makes G a third of E."""
    path = tmp_path / "rubber.csv"
    path.write_text(SAME[form])
    found = tables.read(path)
    (one,) = found.sets
    frequency, storage, loss = np.array(ROWS).T
    assert found.kind == "frequency"
    assert found.tension == (form != "shear")
    assert one.temperature is None
    assert_allclose(one.at, 2 * np.pi * frequency, rtol=1e-14)
    assert_allclose(one.storage, 1e6 * storage / 3, rtol=1e-14)
    assert_allclose(one.loss, 1e6 * loss / 3, rtol=1e-14)


@pytest.mark.parametrize("head", ["t[s] G_relax[kPa] T[K]", "t[s] G(t)[kPa] T[K]", "t G(t) T\ns kPa K"])
def test_relaxation(tmp_path: Path, head: str) -> None:
    path = tmp_path / "rubber.csv"
    path.write_text(f"{head}\n1.0 5 293.15\n0.1 9 293.15\n10 4 293.15\n")
    found = tables.read(path)
    (one,) = found.sets
    assert found.kind == "time"
    assert one.temperature == pytest.approx(20.0, abs=1e-12)
    assert one.at.tolist() == [0.1, 1.0, 10.0]
    assert one.storage.tolist() == [9e3, 5e3, 4e3]
    assert one.loss.size == 0


def test_temperatures_are_sets(tmp_path: Path) -> None:
    """Rows of one temperature, however they are mixed and however it wavers within a degree, in rising order."""
    path = measured.write_sweeps(tmp_path / "rubber.csv")
    head, lines = path.read_text().splitlines()[:2], path.read_text().splitlines()[2:]
    pairs = [line.rsplit(",", 1) for line in lines]
    mixed = [f"{numbers},{float(temperature) + 0.2 * (n % 3 - 1)}" for n, (numbers, temperature) in enumerate(pairs)]
    path.write_text("\n".join([*head, *mixed[::2], *mixed[1::2]]))
    found = tables.read(path)
    assert [round(each.temperature or 0.0) for each in found.sets] == list(measured.TEMPERATURES)
    assert all(each.at.size == measured.FREQUENCIES.size for each in found.sets)


GOOD = text("f,E_stor,E_loss\nHz,MPa,MPa")
BAD = {
    "nothing": ("", "is empty"),
    "comments only": ("# nothing\n", "is empty"),
    "no names": ("1,2,3\n4,5,6\n7,8,9\n10,11,12\n", ":1: names and units"),
    "no units": ("f,E_stor,E_loss\n1,2,3\n4,5,6\n7,8,9\n", ":1: names and units"),
    "no bracket": (text("f[Hz] E'[MPa] E''", mark=" "), "\"E''\" must be a name with its unit"),
    "unknown unit of moduli": (GOOD.replace("MPa", "psi"), "unit of E_stor must be one of Pa, kPa, MPa, GPa, got"),
    "unknown unit of rates": (GOOD.replace("Hz", "rpm"), "unit of f must be one of Hz, rad/s, 1/s, got 'rpm'"),
    "empty unit": (GOOD.replace("Hz,MPa,MPa", ",MPa,MPa"), "unit of f must be one of"),
    "no loss": ("f,E_stor\nHz,MPa\n1,2\n2,3\n3,4\n", "it needs f or omega with E_stor and E_loss"),
    "no rate": ("E_stor,E_loss\nMPa,MPa\n1,2\n2,3\n3,4\n", "has no column f"),
    "no time": ("f,E_relax\nHz,MPa\n1,2\n2,3\n3,4\n", "has no column t"),
    "E' with G''": (text("f[Hz] E'[MPa] G''[MPa]", mark=" "), "it needs f or omega"),
    "a word": (GOOD.replace("3.6", "high"), ":4: E_stor must be a finite number, got 'high'"),
    "not a number": (GOOD.replace("3.6", "nan"), ":4: E_stor must be a finite number, got 'nan'"),
    "decimal commas": (GOOD.replace(",", ";").replace(".", ","), ": its numbers have decimal commas; write them with"),
    "decimal commas, blanks": (
        text("f[Hz] E'[MPa] E''[MPa]", mark=" ").replace(".", ","),
        ": its numbers have decimal commas; write them with",
    ),
    "endless": (GOOD.replace("3.6", "inf"), ":4: E_stor must be a finite number"),
    "negative storage": (GOOD.replace("3.6", "-3.6"), ":4: E_stor must be positive, got -3.6"),
    "negative loss": (GOOD.replace("0.6", "-0.6"), ":4: E_loss must be positive, got -0.6"),
    "zero rate": (GOOD.replace("0.1,", "0,"), ":3: f must be positive, got 0"),
    "a value too few": (GOOD.replace("1.0,3.6,0.6", "1.0,3.6"), ":4: 2 values where 3 columns are named"),
    "a value too many": (GOOD.replace("1.0,3.6", "1,0,3,6"), ":4: 5 values where 3 columns are named"),
    "two rows": ("f,E_stor,E_loss\nHz,MPa,MPa\n1,2,3\n4,5,6\n", "has 2 rows of numbers; at least 3"),
    "binary": ("\x00\x01\x02", "cannot be read as text: it holds bytes of 0"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_will_not_do(tmp_path: Path, case: str) -> None:
    content, sentence = BAD[case]
    path = tmp_path / "rubber.csv"
    path.write_text(content)
    with pytest.raises(InputError) as failure:
        tables.read(path)
    assert sentence in str(failure.value)
    assert str(failure.value).startswith(str(path))
    assert "\n" not in str(failure.value)


def test_no_file(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.csv"):
        with pytest.raises(InputError, match="is not a file"):
            tables.read(path)
