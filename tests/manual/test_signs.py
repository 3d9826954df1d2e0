"""`±` and `µ` are written in one way wherever they are read: in messages, tables, pictures, reports, manual and README.

Names that are typed, as `units: {z: um}`, and comments of job files keep to ASCII. The Greek letter mu, which looks the
same, is another character: what is found by one search is not found by the other.
"""

import io
import re

import pytest
from marched_jobs import ROOT

from parcontact.printed import TolerantStream, quantity, with_error

WRITTEN = [(ROOT / "parcontact", "*.py"), (ROOT / "parcontact", "*.md"), (ROOT / "parcontact", "*.ipynb")]
WRITTEN += [(ROOT / "parcontact", "*.jinja"), (ROOT / "jobs", "*.md"), (ROOT / "scripts", "*.py"), (ROOT, "README.md")]
FILES = sorted({path for place, pattern in WRITTEN for path in place.rglob(pattern) if ".venv" not in path.parts})
WRONG = re.compile(
    r"\+-(?![\w\]*.])|\+/-"  # but of a set of characters, or an exponent
    r"|(?<=[\d}] )u[mNsJ]\b|\[u[mNsJ]\]"  # 3 um, {x} um, [um]
    r"|(?<=\d )[μ][mNsJ]\b"
)
OTHERS = {"map_files.py", "fault.py", "printed.py"}  # take other forms from users, or give them to terminals


def find_other_forms(text: str) -> list[str]:
    return [text[max(0, found.start() - 20) : found.end() + 10] for found in WRONG.finditer(text)]


def test_signs_are_written_in_one_way() -> None:
    found = {path: find_other_forms(path.read_text(encoding="utf-8")) for path in FILES if path.name not in OTHERS}
    assert len(found) > 200
    assert {path.name: places for path, places in found.items() if places} == {}


@pytest.mark.parametrize("text", ["0.4 +- 0.1", "0.4 +/- 0.1", "3 um", "f'{x} um'", "x [um]", "3 \u03bcm"])
def test_other_forms_are_found(text: str) -> None:
    assert len(find_other_forms(text)) == 1


def test_other_forms_are_no_others() -> None:
    assert find_other_forms("0.4 ± 0.1, 3 µm, [\\w.+-], z: um, 1e+-3, gum, to us, units: {xy: mm, z: um}") == []


def test_a_number_and_its_error_have_one_unit() -> None:
    """The error alone would be in µm², which is a millionth of the unit of the number."""
    assert with_error(4.755e-8, 3.3e-10, "m²") == "0.04755 ± 0.00033 mm²"
    assert with_error(1.92e-5, 1.4e-7, "m²") == "19.20 ± 0.14 mm²"
    assert with_error(3.7273e-9, float("nan"), "J") == "3.727 nJ"


def test_a_terminal_of_few_letters_has_signs_of_ascii() -> None:
    numbers = with_error(0.5, 0.01), quantity(1.5e-5, "m"), quantity(2e-9, "m²"), quantity(2.0, "m³")
    shown = ", ".join([*numbers, "20 °C, –×−, é"])
    for encoding, expected in (
        ("ascii", r"0.500 +- 0.010, 15 um, 0.002 mm^2, 2 m^3, 20 deg C, -x-, \xe9"),
        ("utf-8", "0.500 ± 0.010, 15 µm, 0.002 mm², 2 m³, 20 °C, –×−, é"),
    ):
        stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
        TolerantStream(stream, plain=True).write(shown)
        stream.flush()
        assert stream.buffer.getvalue().decode(encoding) == expected
