"""A job: what is simulated and how, from a YAML file or a mapping into frozen sections. The door of its room."""

from ..errors import JobError
from .history import Control, GeometricStep, Initial, Ramp, Stage, Steady, log_range
from .material import Dma, Elastic, PronyBranch, Zener, ZenerBranch
from .model import Job, describe, load
from .sections import Checkpoint, Grid, Numerics, Output
from .study import Study
from .surface import Cylinder, Flat, HeightFile, Rough, Spectral, Sphere, Wave

__all__ = [
    "Checkpoint",
    "Control",
    "Cylinder",
    "Dma",
    "Elastic",
    "Flat",
    "GeometricStep",
    "Grid",
    "HeightFile",
    "Initial",
    "Job",
    "JobError",
    "Numerics",
    "Output",
    "PronyBranch",
    "Ramp",
    "Rough",
    "Spectral",
    "Sphere",
    "Stage",
    "Steady",
    "Study",
    "Wave",
    "Zener",
    "ZenerBranch",
    "describe",
    "load",
    "log_range",
]
