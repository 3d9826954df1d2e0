"""A job: what is simulated and how, from a YAML file or a mapping into frozen sections. The door of its room."""

from ..errors import JobError
from .heights import HeightArray
from .history import AUTO, Control, GeometricStep, Initial, Ramp, Stage, Steady
from .material import Dma, Elastic, PronyBranch, Zener, ZenerBranch
from .model import Job, describe
from .reading import Case, choose, load, load_cases
from .sections import Checkpoint, Grid, Numerics, Output
from .study import Study
from .surface import Cylinder, Flat, HeightFile, OnOneMesh, Rough, Spectral, Sphere, Wave
from .topography import RoughSpectrum, Topography
from .values import log_range

__all__ = [
    "AUTO",
    "Case",
    "Checkpoint",
    "Control",
    "Cylinder",
    "Dma",
    "Elastic",
    "Flat",
    "GeometricStep",
    "Grid",
    "HeightArray",
    "HeightFile",
    "Initial",
    "Job",
    "JobError",
    "Numerics",
    "OnOneMesh",
    "Output",
    "PronyBranch",
    "Ramp",
    "Rough",
    "RoughSpectrum",
    "Spectral",
    "Sphere",
    "Stage",
    "Steady",
    "Study",
    "Topography",
    "Wave",
    "Zener",
    "ZenerBranch",
    "choose",
    "describe",
    "load",
    "load_cases",
    "log_range",
]
