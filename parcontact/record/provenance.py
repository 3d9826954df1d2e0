"""Where a file comes from: what an HDF5 file says about the run that made it."""

import json
import platform
from importlib import metadata

import h5py

from .. import __version__

LIBRARIES = ("numpy", "pyfftw", "mpi4py", "h5py", "numba")
REFERENCES = (
    "Transient frictionless contact of a rough rigid surface on a viscoelastic half-space (method, state variables)",
    "I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206 (conjugate gradients for contact)",
    "A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377 (pressure constant on a cell)",
    "M. Frigo, S. G. Johnson, Proc. IEEE 93 (2005) 216 (FFTW)",
)


def write(file: h5py.File, job: str, chain: list[dict[str, object]], ranks: int, seeds: list[int]) -> None:
    """Attributes of the file: the resolved job as YAML, the chain of earlier runs, ranks, seeds, versions, references."""
    file.attrs["program"] = f"parcontact {__version__}"
    file.attrs["job"] = job
    file.attrs["chain"] = json.dumps(chain)
    file.attrs["ranks"] = ranks
    file.attrs["seeds"] = seeds
    versions = {name: metadata.version(name) for name in LIBRARIES}
    file.attrs["libraries"] = json.dumps({"python": platform.python_version(), "hdf5": h5py.version.hdf5_version, **versions})
    file.attrs["references"] = "\n".join(REFERENCES)
