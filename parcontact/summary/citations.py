"""The references of a run: this program, the method, and the work of others behind what the job has used."""

from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import h5py

from ..errors import InputError
from ..job.text.yamltext import read
from ..storage import hdf5
from ..storage.provenance import PROGRAM

RESOLVED = ("job.resolved.yaml", "steady.resolved.yaml")


class Citation(NamedTuple):
    """A reference, what it stands for, and the feature that a run must have used; '' for all runs."""

    feature: str
    reference: str
    what: str


CITATIONS = (
    Citation(
        "viscoelastic",
        "R. Bugnicourt, P. Sainsot, N. Lesaffre, A. A. Lubrecht, Tribology International 113 (2017) 279: Transient "
        "frictionless contact of a rough rigid surface on a viscoelastic half-space",
        "the method: contact of a viscoelastic half space by state variables",
    ),
    Citation("", "I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206", "conjugate gradients for contact"),
    Citation("", "M. Frigo, S. G. Johnson, Proc. IEEE 93 (2005) 216", "FFTW, which makes the transforms"),
    Citation(
        "",
        "V. A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribology International 114 (2017) 161",
        "the column contact_area_corrected",
    ),
    Citation(
        "kernel love",
        "A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377",
        "the kernel of a pressure that is constant on a cell",
    ),
    Citation("boundary free", "S. Liu, Q. Wang, G. Liu, Wear 243 (2000) 101", "an isolated contact by zero padding"),
    Citation(
        "integrator exponential",
        "R. L. Taylor, K. S. Pister, G. L. Goudreau, Int. J. Numer. Meth. Eng. 2 (1970) 45",
        "the exponential integrator",
    ),
    Citation(
        "shift wlf",
        "M. L. Williams, R. F. Landel, J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701",
        "the shift of relaxation times with temperature",
    ),
    Citation(
        "shape topography",
        "M. C. Röttger et al., Surf. Topogr.: Metrol. Prop. 10 (2022) 035032",
        "SurfaceTopography, which reads measured maps",
    ),
    Citation(
        "interface velocity",
        "B. Lorenz, Y. R. Oh, S. K. Nam, S. H. Jeon, B. N. J. Persson, J. Chem. Phys. 142 (2015) 194701",
        "friction of the contact area itself, as a bell over the velocity",
    ),
    Citation("theory", "B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840", "the theory beside the run"),
    Citation("theory", "B. N. J. Persson, A. I. Volokitin, Phys. Rev. B 65 (2002) 134106", "the theory with time"),
    Citation(
        "theory",
        "M. Scaraggi, B. N. J. Persson, J. Phys.: Condens. Matter 27 (2015) 105102",
        "the factor gamma of the theory",
    ),
)


def describe(directory: Path) -> str:
    """Return what to cite for the run in a directory. Raises InputError where none is, or its job is damaged."""
    found = next((directory / name for name in RESOLVED if (directory / name).is_file()), None)
    if found is None:
        raise InputError(f"{directory} holds no run: it has neither {' nor '.join(RESOLVED)}")
    lines = [f"{directory}: please cite", "", f"* {_program(directory)}", "    this program (CITATION.cff)"]
    try:
        used = _features(read(found, str(found)).data, directory)
    except (AttributeError, KeyError, TypeError) as error:
        raise InputError(f"{found} is damaged: not every section of a resolved job is there; run it again") from error
    for one in CITATIONS:
        if one.feature in used:
            lines += [f"* {one.reference}", f"    {one.what}"]
    return "\n".join(lines)


def _features(job: dict[str, Any], directory: Path) -> set[str]:
    """Return the features that a resolved job in a directory has used."""
    material, numerics = job["material"], job["numerics"]
    shift = material.get("shift", "")
    found = {
        "",
        f"kernel {numerics['kernel']}",
        f"boundary {job['grid']['boundary']}",
        f"shift {shift['law'] if isinstance(shift, dict) else shift}",
        *(f"shape {shape['shape']}" for shape in job["surface"]),
        *(f"interface {key}" for key in job.get("interface") or {}),
    }
    if material["model"] != "elastic":
        found |= {"viscoelastic", f"integrator {numerics['integrator']}" if job.get("history") else ""}
    if any((directory / name).is_file() for name in ("theory.csv", "steady_theory.csv")):
        found.add("theory")
    return found


def _program(directory: Path) -> str:
    """Return the version that made the maps, if there are any; otherwise the present one."""
    for name in ("fields.h5", "steady.h5"):
        with suppress(*hdf5.FAILURES), h5py.File(directory / name) as file:
            return str(file.attrs["program"])
    return PROGRAM
