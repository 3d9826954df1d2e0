"""References to cite for a run: this program, and the references of its job (`storage.provenance`)."""

from contextlib import suppress
from pathlib import Path

import h5py

from ..errors import InputError
from ..job.resolved import RESOLVED, STEADY_RESOLVED
from ..job.text.yamltext import read_source
from ..storage import hdf5
from ..storage.provenance import PROGRAM, references_of


def describe_citations(directory: Path) -> str:
    """Return the references to cite for the run in a directory. Raises InputError without a run, or if its job is
    damaged."""
    names = (RESOLVED, STEADY_RESOLVED)
    found = next((directory / name for name in names if (directory / name).is_file()), None)
    if found is None:
        raise InputError(f"{directory} has no run: it has neither {' nor '.join(names)}")
    theory = ["theory"] * any((directory / name).is_file() for name in ("theory.csv", "steady_theory.csv"))
    try:
        cited = references_of(read_source(found, str(found)).data, theory)
    except (AttributeError, KeyError, TypeError) as error:
        raise InputError(f"{found} is damaged: it lacks sections of a resolved job; run it again") from error
    lines = [f"{directory}: please cite", "", f"* {_program(directory)}", "    this program (CITATION.cff)"]
    return "\n".join([*lines, *(line for reference, what in cited for line in (f"* {reference}", f"    {what}"))])


def _program(directory: Path) -> str:
    """Return the version of the program in the saved maps, or the present one without maps."""
    for name in ("fields.h5", "steady.h5"):
        with suppress(*hdf5.FAILURES), h5py.File(directory / name) as file:
            return str(file.attrs["program"])
    return PROGRAM
