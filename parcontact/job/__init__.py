"""The job: the description of a simulation, read from a YAML file or a mapping into frozen sections."""

from ..errors import JobError
from .calculation import Checkpoint, Grid, Numerics, Output, Study
from .materials import Dma, Elastic, PronyBranch, Zener, ZenerBranch
from .model import Job, describe_job
from .parts import AUTO, Part, Positive, log_range
from .reading import Case, load, load_cases, select_cases
from .stages import GeometricStep, Initial, Ramp, Stage, Steady, Swing
from .surfaces import (
    Cone,
    Cylinder,
    Flat,
    HeightArray,
    HeightFile,
    Indenter,
    OnOneMesh,
    Punch,
    Pyramid,
    Rough,
    RoughSpectrum,
    Spectral,
    Sphere,
    Topography,
    Wave,
)
