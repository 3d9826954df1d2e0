"""A job: the description of a simulation, read from a YAML file or a mapping into frozen sections."""

from ..errors import JobError
from .model import Job, describe_job
from .reading import Case, load, load_cases, select_cases
from .sections.calculation import Checkpoint, Grid, Numerics, Output, Study
from .sections.geometry import (
    Cone,
    Cylinder,
    Flat,
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
from .sections.height_arrays import HeightArray
from .sections.materials import Dma, Elastic, PronyBranch, Zener, ZenerBranch
from .sections.oscillation import Swing
from .sections.part import Part
from .sections.quantities import Positive, log_range
from .sections.stages import AUTO, GeometricStep, Initial, Ramp, Stage, Steady
