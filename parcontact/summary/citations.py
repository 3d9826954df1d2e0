"""What to cite for a run: this program, the method, and the work of others behind what the job has used."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..job.text.yamltext import read
from ..storage import hdf5
from ..storage.provenance import PROGRAM

Job = dict[str, Any]
RESOLVED = ("job.resolved.yaml", "steady.resolved.yaml")


@dataclass(frozen=True)
class Citation:
    """A reference, what it stands for, and whether a resolved job in a directory has used it."""

    reference: str
    what: str
    used: Callable[[Job, Path], bool]


def _always(job: Job, directory: Path) -> bool:
    return True


def _viscoelastic(job: Job, directory: Path) -> bool:
    return job["material"]["model"] != "elastic"


def _integrator(name: str) -> Callable[[Job, Path], bool]:
    def used(job: Job, directory: Path) -> bool:
        return bool(job.get("history")) and _viscoelastic(job, directory) and job["numerics"]["integrator"] == name

    return used


def _law(job: Job) -> str:
    shift = job["material"].get("shift", "")
    return str(shift["law"] if isinstance(shift, dict) else shift)


def _shape(name: str) -> Callable[[Job, Path], bool]:
    return lambda job, directory: any(shape["shape"] == name for shape in job["surface"])


def _theory(job: Job, directory: Path) -> bool:
    return any((directory / name).is_file() for name in ("theory.csv", "steady_theory.csv"))


CITATIONS = (
    Citation(
        "R. Bugnicourt, P. Sainsot, N. Lesaffre, A. A. Lubrecht, Tribology International 113 (2017) 279: Transient "
        "frictionless contact of a rough rigid surface on a viscoelastic half-space",
        "the method: contact of a viscoelastic half space by state variables",
        _viscoelastic,
    ),
    Citation("I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206", "conjugate gradients for contact", _always),
    Citation("M. Frigo, S. G. Johnson, Proc. IEEE 93 (2005) 216", "FFTW, which makes the transforms", _always),
    Citation(
        "V. A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribology International 114 (2017) 161",
        "the column contact_area_corrected",
        _always,
    ),
    Citation(
        "A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377",
        "the kernel of a pressure that is constant on a cell",
        lambda job, directory: job["numerics"]["kernel"] == "love",
    ),
    Citation(
        "S. Liu, Q. Wang, G. Liu, Wear 243 (2000) 101",
        "an isolated contact by zero padding",
        lambda job, directory: job["grid"]["boundary"] == "free",
    ),
    Citation(
        "R. L. Taylor, K. S. Pister, G. L. Goudreau, Int. J. Numer. Meth. Eng. 2 (1970) 45",
        "the exponential integrator",
        _integrator("exponential"),
    ),
    Citation(
        "M. L. Williams, R. F. Landel, J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701",
        "the shift of relaxation times with temperature",
        lambda job, directory: _law(job) == "wlf",
    ),
    Citation(
        "M. C. Röttger et al., Surf. Topogr.: Metrol. Prop. 10 (2022) 035032",
        "SurfaceTopography, which reads measured maps",
        _shape("topography"),
    ),
    Citation(
        "B. Lorenz, Y. R. Oh, S. K. Nam, S. H. Jeon, B. N. J. Persson, J. Chem. Phys. 142 (2015) 194701",
        "friction of the contact area itself, as a bell over the velocity",
        lambda job, directory: "velocity" in (job.get("interface") or {}),
    ),
    Citation("B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840", "the theory beside the run", _theory),
    Citation(
        "B. N. J. Persson, A. I. Volokitin, Phys. Rev. B 65 (2002) 134106",
        "the theory with time",
        _theory,
    ),
    Citation(
        "M. Scaraggi, B. N. J. Persson, J. Phys.: Condens. Matter 27 (2015) 105102",
        "the factor gamma of the theory",
        _theory,
    ),
)


def describe(directory: Path) -> str:
    """What to cite for the run in a directory. Raises InputError where none is, or its job is damaged."""
    found = next((directory / name for name in RESOLVED if (directory / name).is_file()), None)
    if found is None:
        raise InputError(f"{directory} holds no run: it has neither {' nor '.join(RESOLVED)}")
    job = read(found, str(found)).data
    lines = [f"{directory}: please cite", "", f"* {_program(directory)}", "    this program (CITATION.cff)"]
    try:
        for one in (one for one in CITATIONS if one.used(job, directory)):
            lines += [f"* {one.reference}", f"    {one.what}"]
    except (AttributeError, KeyError, TypeError) as error:
        raise InputError(f"{found} is damaged: not every section of a resolved job is there; run it again") from error
    return "\n".join(lines)


def _program(directory: Path) -> str:
    """The version that made the maps, if there are any; otherwise the present one."""
    return next(_written(directory), PROGRAM)


def _written(directory: Path) -> Iterator[str]:
    import h5py

    for name in ("fields.h5", "steady.h5"):
        try:
            with h5py.File(directory / name) as file:
                yield str(file.attrs["program"])
        except (KeyError, *hdf5.FAILURES):
            continue
