"""Tables of moduli, shift factors, spectra and heights in the dialects of instruments: one reader for all."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.errors import InputError
from parcontact.job import RoughSpectrum, Topography, map_files, measured_maps
from parcontact.rubber import moduli
from parcontact.rubber.shift import Factors, read_shift

Array = np.ndarray
ROWS = np.array([[20.0, 0.5, 5.25, 0.5], [20.0, 5.0, 6.125, 0.7], [20.0, 50.0, 7.5, 1.0]])  # C, Hz, MPa, MPa


def read_moduli(path: Path) -> Array:
    """Young's moduli [MPa] over frequency [Hz], at their temperature [deg C], in the rows of the file."""
    (one,) = moduli.read_moduli(path).sets
    return np.stack(
        [np.full(one.at.size, one.temperature), one.at / (2 * np.pi), 3e-6 * one.storage, 3e-6 * one.loss], 1
    )


def read_shift_table(path: Path) -> Array:
    found = read_shift(str(path), None)
    assert isinstance(found, Factors)
    return np.stack([found.temperatures, found.logs], 1)


def read_spectrum(path: Path) -> Array:
    """q [1/m] and C2D [m^4]."""
    found, _ = measured_maps.read_spectrum(
        RoughSpectrum.model_construct(spectrum=path, normalisation="physical", hurst=None), False
    )
    return np.stack([found.q, found.phi / (4 * np.pi**2)], 1)


def read_map(path: Path) -> Array:
    """Heights [um]."""
    part = Topography.model_construct(path=path, unit="um", size=(4e-5, 3e-5))
    return 1e6 * map_files.read_map(part).heights


def lines(head: str, rows: Array, mark: str, comma: bool = False) -> str:
    body = [mark.join(f"{value!r}" for value in row) for row in rows.tolist()]
    return "\n".join([head, *([line.replace(".", ",") for line in body] if comma else body)]) + "\n"


HEADS = {  # header, mark between numbers, decimal commas
    "lines of a laboratory": (
        "Temperature (°C);Frequency (Hz);Storage Modulus E' (MPa);Loss Modulus E'' (MPa)",
        ";",
        False,
    ),
    "decimal commas": ("T[C];f[Hz];E'[MPa];E''[MPa]", ";", True),
    "decimal commas between tabs": ("T[C]\tf[Hz]\tE'[MPa]\tE''[MPa]", "\t", True),
    "decimal commas between blanks": ("T[C] f[Hz] E'[MPa] E''[MPa]", " ", True),
    "two comments": (
        "# Data of a curve\n# T (°C)\tFrequency (Hz)\tE' Storage Modulus (MPa)\tE'' Loss Modulus (MPa)",
        "\t",
        False,
    ),
    "a comment between blanks": ("# T[C] f[Hz] E'[MPa] E''[MPa]", " ", False),
    "a comment with commas": ("% T[C], f[Hz], E'[MPa], E''[MPa]", " ", False),
    "two comments with units": ("# T f E' E''\n# °C Hz MPa MPa", " ", False),
    "round brackets": ("Temp(C),Freq(Hz),Storage Modulus (MPa),Loss Modulus (MPa)", ",", False),
    "slashes": ("T/°C;Freq./Hz;E'/MPa;E''/MPa", ";", False),
    "slashes and brackets": ("t / °C,f / (Hz),E' / [MPa],E'' / MPa", ",", False),
    "words between blanks": ("Temperature (C) Frequency (Hz) Storage Modulus (MPa) Loss Modulus (MPa)", " ", False),
    "symbols behind words": (
        "Temperature T [C],Frequency f [Hz],Storage modulus (E') [MPa],Loss modulus E'' [MPa]",
        "\t",
        False,
    ),
    "a date above": ("Sample 12\n2024 3 1\nT[C],f[Hz],E'[MPa],E''[MPa]", ",", False),
}


@pytest.mark.parametrize("form", HEADS)
def test_headers(tmp_path: Path, form: str) -> None:
    """All mean the same four columns; the numbers are written in full."""
    head, mark, comma = HEADS[form]
    path = tmp_path / "table.txt"
    path.write_text(lines(head, ROWS, mark, comma))
    assert_allclose(read_moduli(path), ROWS, rtol=1e-14)


REFUSED = {
    "two headers": (
        "f[Hz] E'[Pa] E''[Pa]\nf[Hz] E''[Pa] E'[Pa]\n",
        ":1: its names of columns differ from those in line 2",
    ),
    "a header in a comment below": (
        "f[Hz] E'[Pa] E''[Pa]\n1 2 1\n# f[Hz] E''[Pa] E'[Pa]\n",
        ":3: its names of columns",
    ),
    "a name and another symbol": ("f[Hz],Storage modulus E''[Pa],E'[Pa]\n", "it needs f or omega"),
    "a unit behind a slash": ("f/rpm,E'/Pa,E''/Pa\n", "the unit of f must be one of Hz, rad/s, 1/s, got 'rpm'"),
    "a word": ("f[Hz],E'[Pa],E''[Pa]\n1,---,1\n", ":2: E_stor must be a finite number, got '---'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_headers(tmp_path: Path, case: str) -> None:
    text, sentence = REFUSED[case]
    mark = "," if "," in text else " "
    path = tmp_path / "table.txt"
    path.write_text(text + lines("", ROWS[:, 1:], mark))
    with pytest.raises(InputError) as failure:
        moduli.read_moduli(path)
    assert str(failure.value).startswith(str(path))
    assert sentence in str(failure.value)


# -- the same table in random dialects: read as it is, or refused in one sentence --------------------------------------


@dataclass(frozen=True)
class Kind:
    read: Callable[[Path], Array]
    names: tuple[tuple[str, str], ...]  # names and units
    rows: Array


DICE = np.random.default_rng(3)
MAP = np.round(DICE.normal(size=(6, 8)), 3)
KINDS = {
    "moduli": Kind(read_moduli, (("T", "C"), ("f", "Hz"), ("E'", "MPa"), ("E''", "MPa")), ROWS),
    "shift": Kind(
        read_shift_table,
        (("T", "C"), ("log_aT", "")),
        np.array([[-20.0, 3.25], [0.5, 1.5], [20.0, 0.0], [40.0, -1.125]]),
    ),
    "spectrum": Kind(
        read_spectrum, (("q", "1/m"), ("C2D", "m^4")), np.array([[1e4, 1.25e-18], [2e4, 8e-20], [4e4, 6.5e-21]])
    ),
    "map": Kind(read_map, (), MAP),
}
WORDS = ("", "---", "#N/A", "nan", "No Data", "n/a")
FORMS = ("{}[{}]", "{} ({})", "{} [{}]", "{}/{}", "{} / {}", "{}")


def write(path: Path, kind: Kind, dice: np.random.Generator) -> Array:
    """Write a table in a random dialect. Return its rows, with NaN where a word for a missing number was written."""
    mark = str(dice.choice([",", ";", "\t", " ", "   ", ", ", "; ", " \t"]))
    comma, rows = bool(dice.random() < 0.4), kind.rows.copy()
    cells = [
        [
            str(dice.choice([f"{v!r}", f"{v:.6g}", f"{v:.6E}", f"{v:+.9f}"])) if abs(v) > 1e-3 or v == 0 else f"{v!r}"
            for v in row
        ]
        for row in rows.tolist()
    ]
    cells = [[cell.replace(".", ",") if comma else cell for cell in row] for row in cells]
    if dice.random() < 0.3:
        i, j = (int(dice.integers(n)) for n in rows.shape)
        cells[i][j], rows[i, j] = str(dice.choice(WORDS)), np.nan
    form, note = str(dice.choice(FORMS)), str(dice.choice(["", "", "# ", "% "]))
    between = mark if mark.strip(" ") or form in ("{}[{}]", "{}/{}") else "  "
    head = [between.join(form.format(*name) if name[1] else name[0] for name in kind.names)] if kind.names else []
    if form == "{}" and head:
        head.append(mark.join(name[1] or "-" for name in kind.names))
    above = list(
        dice.choice(
            ["Sample SBR 50", "Operator;me", "Date\t2024-01-01", "", "Comment: f, T and E"], int(dice.integers(3))
        )
    )
    if not kind.names:
        above, note = [f"# {line}" for line in above], ""
    end = str(dice.choice(["", "", "", mark]))
    body = [mark.join(row) + end for row in cells] + [""] * int(dice.integers(3))
    text = str(dice.choice(["\n", "\r\n"])).join([*above, *(note + line for line in head), *body, ""])
    path.write_bytes(text.encode(str(dice.choice(["utf-8", "utf-8-sig", "utf-16", "latin-1"]))))
    return rows


@pytest.mark.parametrize("name", KINDS)
def test_random_dialects(tmp_path: Path, name: str) -> None:
    """50 dialects of each table: equal to the six written digits, or one sentence that begins with the file."""
    kind, dice, refused = KINDS[name], np.random.default_rng(58), []
    for number in range(50):
        path = tmp_path / f"table{number}.txt"
        rows = write(path, kind, dice)
        try:
            found = kind.read(path)
        except InputError as error:
            refused.append((path, str(error)))
            continue
        assert found.shape == rows.shape, path.read_bytes()
        assert_allclose(found, rows, rtol=1e-5, atol=1e-8 * bool(name != "spectrum"), err_msg=str(path.read_bytes()))
    assert len(refused) < 25
    assert all(text.startswith(str(path)) and "\n" not in text for path, text in refused)
