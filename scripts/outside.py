"""How scripts that are themselves processes of MPI start others with mpirun."""

import os
from pathlib import Path


def environment() -> dict[str, str]:
    """The environment without the marks that MPI has left in it, which would confuse another mpirun.

    An mpirun whose ranks have ended with an error ends at once, too: it would give each 3 s and again 3 s to do so.
    """
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("OMPI_", "PMIX_", "PRTE_"))}
    return clean | {"OMPI_MCA_odls_base_sigkill_timeout": "0", "PRTE_MCA_odls_base_sigkill_timeout": "0"}


def ranks_of(pid: int) -> list[int]:
    """The ranks of an mpirun of scripts/setup, in their order: they are the children of its only child."""
    return [rank for launcher in _children(pid) for rank in _children(launcher)]


def _children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
