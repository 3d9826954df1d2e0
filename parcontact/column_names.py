"""Names of columns in tables of moduli, shift factors, spectra and heights, and how headers spell them."""

import re
from typing import NamedTuple

WITH_UNIT = re.compile(r"(.+?)[\s/]*(?:\[([^\]]*)\]|\(([^()]*(?:\([^()]*\)[^()]*)*)\))")  # E'[MPa], q (1/(m))
PRIMES = {"'": "stor", "''": "loss", '"': "loss"}  # E', E'', E"
WORDS = {  # lower case; * is an unknown letter
    **dict.fromkeys(("frequency", "f_set", "freq", "freq."), "f"),
    **dict.fromkeys(("angular frequency", "ang. frequency", "w", "ω"), "omega"),
    **{"time": "t", "step time": "t", "temperature": "T", "temp": "T", "temp.": "T"},
    **{"storage modulus": "*_stor", "loss modulus": "*_loss", "relaxation modulus": "*_relax"},
    **{"complex modulus": "*_abs", "creep compliance": "*_creep", "compliance": "*_creep"},
    **{f"shear {word} modulus": f"G_{short}" for word, short in (("storage", "stor"), ("loss", "loss"))},
    **{f"shear {word} modulus": f"G_{short}" for word, short in (("relaxation", "relax"), ("complex", "abs"))},
    **{"complex shear modulus": "G_abs", "shear creep compliance": "G_creep", "tensile creep compliance": "E_creep"},
    **{"e(t)": "E_relax", "g(t)": "G_relax", "d(t)": "E_creep", "j(t)": "G_creep"},
    **dict.fromkeys(("tan delta", "tan(delta)", "tan_delta", "tan d", "tan δ", "tanδ", "loss factor"), "tan_del"),
    **dict.fromkeys(("tan(δ)", "damping factor"), "tan_del"),
    **dict.fromkeys(("delta", "δ", "phase angle", "phase", "loss angle", "phase shift angle"), "delta"),
    **dict.fromkeys(("q", "wavenumber", "wave number", "wavevector", "wave vector"), "q"),
    **dict.fromkeys(("strain", "strain amplitude", "shear strain", "dynamic strain", "gamma", "γ"), "strain"),
    **{"g": "g", "c1d": "C1D", "c2d": "C2D", "x": "x", "y": "y", "z": "z", "height": "z", "heights": "z"},
}
MODULI = {f"{letter}_{part}" for letter in "EG*" for part in ("stor", "loss", "relax", "abs", "creep")}
TEMPERATURES = {"C": 0.0, "°C": 0.0, "degC": 0.0, "deg C": 0.0, "K": -273.15}  # added to them for deg C
NUMBERS = {"tan_del", "log_aT", "log_bT"}  # columns without a unit
NAMES = MODULI | NUMBERS | {"T", "t"} | set(WORDS.values())
SHIFT = re.compile(r"(?:log(?:_?10)?|lg)[\s_(]*([ab])_?t\)?")  # log_aT, log10(a_T)


class Column(NamedTuple):
    """A name of NAMES, or another text, and a unit; None if the cell has none."""

    name: str
    unit: str | None


def read_cell(cell: str) -> Column:
    """Return the name and the unit in a cell of a header."""
    text = re.sub(r'^"(.*)"$', r"\1", cell.strip())
    if name := find_name(text):  # E(t), tan(delta)
        return Column(name, None)
    if match := WITH_UNIT.fullmatch(text):
        return _of_temperature(find_name(match[1]) or match[1], plain_unit(match[2] or match[3] or ""))
    for at in (at for at, letter in enumerate(text) if letter == "/"):
        name, unit = find_name(text[:at]), text[at + 1 :].strip()
        if name and not find_name(unit):
            return _of_temperature(name, plain_unit(unit))
    return Column(text, None)


def _of_temperature(name: str, unit: str) -> Column:
    """Return a column; t in deg C is a temperature."""
    return Column("T" if name == "t" and unit.endswith(("C", "K")) else name, unit)


def plain_unit(unit: str) -> str:
    """Return a unit without brackets, with powers as ^n; a dash is no unit."""
    unit = re.sub(r"^[\[(](.*)[\])]$", r"\1", unit.strip()).strip().replace("⁻¹", "^-1").replace("℃", "°C")
    unit = unit.replace("³", "^3").replace("⁴", "^4").replace("**", "^").replace("²", "^2")
    return "" if unit in ("-", "1", "[-]") else unit


def find_name(text: str) -> str:
    """Return the name of NAMES that a text means, by a word, a symbol, or both; '' if there is none."""
    text = re.sub(r"\s+", " ", text.strip(" ,:")).replace("″", "''").replace("′", "'").replace("’", "'")
    if text in NAMES or (name := _symbol(text)):
        return text if text in NAMES else name
    if name := WORDS.get(text.lower(), ""):
        return name
    words = re.sub(r"[(\[]([^()\[\]]*)[)\]]$", r" \1", text).split()
    for at in range(1, len(words)):
        pair = {find_name(" ".join(words[:at])), find_name(" ".join(words[at:]))}
        exact = {name for name in pair if not name.startswith("*")}
        if "" not in pair and len(exact) < 2 and len({name[1:] for name in pair}) == 1:
            return (exact or pair).pop()
    return ""


def _symbol(text: str) -> str:
    if match := re.fullmatch(r"([EG])('{1,2}|\")", text):
        return f"{match[1]}_{PRIMES[match[2]]}"
    if match := re.fullmatch(r"\|?([EG])\*\|?", text):
        return f"{match[1]}_abs"
    match = SHIFT.fullmatch(text.lower())
    return f"log_{match[1]}T" if match else ""
