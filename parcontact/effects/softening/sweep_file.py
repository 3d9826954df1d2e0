"""Files of strain sweeps: factors of both moduli, or moduli, over the amplitude of the strain."""

from pathlib import Path

from ...errors import InputError
from ...text_tables import Table, read_named_columns
from .strain_table import StrainTable

FACTORS = ("f", "g")  # of the storage and of the loss modulus
PAIRS = (("G_stor", "G_loss"), ("E_stor", "E_loss"), ("*_stor", "*_loss"))
HELD = {"f": "frequency", "omega": "frequency", "T": "temperature"}  # of which a sweep has one
NAMES = {"strain", *FACTORS, "omega", "T", *(name for pair in PAIRS for name in pair)}
PLAIN = {"strain", *FACTORS}  # columns that need no unit
HIGHEST = 10.0  # physics: strain [-] that no rubber reaches in shear
UNITS = {"": 1.0, "%": 0.01}
EXAMPLE = "strain,f,g or strain[%],G'[MPa],G''[MPa]"


def read_sweep(path: Path, reference: float | None) -> tuple[StrainTable, str]:
    """Return the factors in a file, and a sentence on the strain at which they are 1; '' for factors.

    Moduli are divided by those at the strain `reference` [-], by default the first row. Raises InputError with the file
    and what was expected.
    """
    table = read_named_columns(path, f"a strain sweep ({EXAMPLE})", EXAMPLE, NAMES, _is_header, PLAIN)
    pair = next((pair for pair in (FACTORS, *PAIRS) if {"strain", *pair} <= table.columns.keys()), None)
    if pair is None or len(table.lines) < 2:
        raise InputError(f"{path}: a strain sweep with at least two rows was expected ({EXAMPLE})")
    _refuse_several(table, pair)
    unit = table.unit("strain", UNITS)
    rows = sorted(zip(*(table.columns[name] for name in ("strain", *pair)), strict=True))
    strain, storage, loss = (tuple(column) for column in zip(*rows, strict=True))
    strain = tuple(unit * value for value in strain)
    if not strain[0] > 0.0 or len(set(strain)) < len(strain) or min(*storage, *loss) <= 0.0:
        raise InputError(f"{path}: strains must be positive and different, moduli or factors positive")
    if strain[-1] > HIGHEST and not table.units.get("strain"):
        raise InputError(
            f"{path}: strains without a unit reach {strain[-1]:g}; write strain[%] if they are in per cent"
        )
    found = StrainTable(strain, storage, loss)
    if pair == FACTORS:
        return found, ""
    at = strain[0] if reference is None else reference
    if not found.reaches(at):
        raise InputError(
            f"{path}: softening.reference_strain {at:g} is outside of its strains, {strain[0]:g} to {strain[-1]:g}"
        )
    first, second = (float(value) for value in found.factors(at))
    why = "the smallest one, as softening.reference_strain is not given" if reference is None else "as given"
    said = f"softening: moduli of {path.name} are divided by those at a strain of {at:g}, {why}"
    return StrainTable(strain, tuple(v / first for v in storage), tuple(v / second for v in loss)), said


def _is_header(names: set[str]) -> bool:
    return "strain" in names and any(names.issuperset(pair) for pair in (FACTORS, *PAIRS))


def _refuse_several(table: Table, pair: tuple[str, str]) -> None:
    """Refuse sweeps at several frequencies or temperatures."""
    for name, what in HELD.items():
        values = sorted(set(table.columns.get(name, ()))) if name not in pair else []
        if len(values) > 1:
            few = f"{values[0]:g} to {values[-1]:g} {table.units[name]}".strip()
            raise InputError(
                f"{table.path}: a strain sweep has one {what}, got {len(values)}, {few}; keep the rows of one"
            )
