"""Transient contact of a rough rigid surface on a viscoelastic half space, on any number of MPI ranks."""

__version__ = "0.1.0"
