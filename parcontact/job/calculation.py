"""Sections of a job on the calculation: `grid`, `numerics`, `output`, `checkpoint`, `study` and `bands`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, PrivateAttr, TypeAdapter, ValidationInfo

from ..capabilities import stated
from .parts import (
    AUTO,
    FROM_SURFACE,
    Auto,
    Count,
    Flag,
    Fraction,
    Instead,
    Number,
    Origin,
    Part,
    Positive,
    Rule,
    Whole,
    both,
    from_home,
    listed,
    rules_of,
)
from .yaml_text import Fault, did_you_mean, quote, refuse

Integrator = Literal["exponential", "exponential-linear", "backward-euler"]
Kernel = Literal["spectral", "love"]
Precision = Literal["double", "mixed"]
FIELDS_NEED = {name: need for fields in stated("FIELDS_NEED") for name, need in fields.items()}  # maps of effects
VECTORS = [name for names in stated("VECTORS") for name in names]
FieldName: Any = Literal["pressure", "displacement", "gap", "height", *FIELDS_NEED]


def _different(name: str) -> Rule:
    """Return the rule that the values of a list differ."""

    def check(values: tuple[Any, ...]) -> Iterator[Fault]:
        for index, value in enumerate(values):
            if value is not None and value in values[:index]:
                yield Fault(f"repeats {value if name == 'fields' else repr(value)}", (name, index))

    return Rule((name,), check)


def _boundary(value: Any) -> Any:
    """Return `periodic`, `free`, or the pair of both; a pair of two equal words becomes one word."""
    pair = tuple(value) if isinstance(value, list | tuple) else (value, value)
    if pair == STRIP[::-1]:
        refuse(Fault("must be [periodic, free] if it is free along one axis, got [free, periodic]: exchange x and y"))
    if len(pair) != 2 or any(one not in STRIP for one in pair):
        refuse(Fault(f"must be {BOUNDARY}, got {quote(value)}{did_you_mean(value, STRIP)}"))
    return pair if pair == STRIP else pair[0]


STRIP = ("periodic", "free")  # along x and along y
BOUNDARY = "periodic | free | [periodic, free]"
Boundary = Literal["periodic", "free"] | tuple[Literal["periodic"], Literal["free"]]


class Grid(Part):
    """The box and its cells. In `points` and `size`, x comes first."""

    points: Annotated[tuple[Count, Count], BeforeValidator(both), FROM_SURFACE, AUTO] = Field(
        description="a positive whole number of points"
    )
    size: Annotated[tuple[Positive, Positive], BeforeValidator(both), FROM_SURFACE] = Field(
        description="a positive length [m]"
    )
    boundary: Annotated[Boundary, PlainValidator(_boundary, json_schema_input_type=Boundary)] = Field(
        default="periodic", description=BOUNDARY
    )

    @property
    def cyclic(self) -> tuple[bool, bool]:
        """Return two values, for x and for y: True if the box is periodic along this axis."""
        return self.boundary != "free", self.boundary == "periodic"

    @property
    def is_line(self) -> bool:
        """Return True if the grid is one row or one column of points, so that surfaces on it are profiles. Return False
        for a single point."""
        return (self.nx == 1) != (self.ny == 1)

    @property
    def longest_side(self) -> float:
        """Length of the box [m], the longer one; on a line of points that along the line."""
        return max(size for size, n in zip(self.size, self.points, strict=True) if n > 1 or not self.is_line)

    @property
    def longest_cell(self) -> float:
        """Length of a cell [m], the longer one; on a line of points that along the line."""
        cells = zip((self.dx, self.dy), self.points, strict=True)
        return max(cell for cell, n in cells if n > 1 or not self.is_line)

    @property
    def nx(self) -> int:
        return self.points[0]

    @property
    def ny(self) -> int:
        return self.points[1]

    @property
    def lx(self) -> float:
        """Length of the box along x [m]."""
        return self.size[0]

    @property
    def ly(self) -> float:
        """Length of the box along y [m]."""
        return self.size[1]

    @property
    def dx(self) -> float:
        """Length of a cell along x [m]."""
        return self.lx / self.nx

    @property
    def dy(self) -> float:
        """Length of a cell along y [m]."""
        return self.ly / self.ny


TOLERANCE_SHARE, BRANCH_SHARE = 0.5, 0.1  # accuracy: tolerance and branch_error, over numerics.accuracy
AREA_BY_STEPS = 0.25  # accuracy: largest error of the area by time steps, over the error of friction
FRACTION: TypeAdapter[float] = TypeAdapter(Fraction)


class Accuracy(Part):
    """The relative errors of friction and of the corrected contact area that the user accepts."""

    friction: Fraction = Field(default=1e-2, description="an error of friction [-] above 0 and below 1")
    area: Fraction = Field(default=1e-2, description="an error of the contact area [-] above 0 and below 1")

    @property
    def both(self) -> tuple[float, float]:
        """Return the accuracies of friction and of the area as a pair."""
        return self.friction, self.area

    @property
    def strictest(self) -> float:
        return min(self.friction, self.area)

    @property
    def of_steps(self) -> float:
        """Return the relative error of friction that time steps may cause. The same steps cause an error of the area
        that is at most a quarter as large. So the result is the accuracy of friction, or four times the accuracy of the
        area if this is smaller."""
        return min(self.friction, self.area / AREA_BY_STEPS)


def _accuracy(value: Any, info: ValidationInfo) -> float | Accuracy:
    if isinstance(value, dict | Accuracy):
        return Accuracy.model_validate(value, context=info.context)
    return FRACTION.validate_python(value, context=info.context)


class Numerics(Part):
    """Settings of the solution. The accuracy determines the mesh of `points: auto`, and the values of `tolerance` and
    `branch_error` if the job does not give them."""

    accuracy: Annotated[float | Accuracy, PlainValidator(_accuracy, json_schema_input_type=Fraction | Accuracy)] = (
        Field(default=1e-2, description="an error of friction and area [-] above 0 and below 1, or {friction, area}")
    )
    integrator: Integrator = "exponential"
    tolerance: Fraction = Field(default=5e-3, description="a tolerance [-] above 0 and below 1")
    max_iterations: Count = Field(default=500, description="a positive whole number of iterations")
    branch_error: Number = Field(
        default=1e-3, ge=0, lt=1, description="an error of friction [-] of zero or more and below 1"
    )
    kernel: Kernel = "spectral"  # in a free scene: love
    precision: Precision = "double"
    accept_unconverged: Flag = False
    strict: Flag = False

    foreign = MappingProxyType({"slope": Instead("it was removed; slopes follow from the waves of the surface")})
    _chosen: dict[str, float] = PrivateAttr(default_factory=dict)

    def model_post_init(self, context: Any) -> None:
        """Choose tolerance and branch error by the accuracy unless they are given."""
        least = self.asked.strictest
        shares = {"tolerance": TOLERANCE_SHARE * least, "branch_error": BRANCH_SHARE * least}
        self._chosen = {name: share for name, share in shares.items() if name not in self.model_fields_set}
        self.__dict__.update(self._chosen)

    @property
    def chosen(self) -> dict[str, float]:
        """Return the values that follow from `accuracy`, by their keys."""
        return self._chosen

    @property
    def asked(self) -> Accuracy:
        """Return the accuracies of friction and of the area, which are equal if one number is given."""
        if isinstance(self.accuracy, Accuracy):
            return self.accuracy
        return Accuracy(friction=self.accuracy, area=self.accuracy)


def _needs_energy(branch_dissipation: bool, energy: bool) -> Iterator[Fault]:
    if branch_dissipation and not energy:
        yield Fault("needs energy: true", ("branch_dissipation",))


MEASURE_MESH = "it was removed; `parcontact study` measures the error of the mesh, with a list study.mesh"


def components_of(field: str) -> tuple[str, ...]:
    """Return the names of the maps of a field: one for each component of a vector."""
    return (f"{field}_x", f"{field}_y") if field in VECTORS else (field,)


class Output(Part):
    """Output files of a run. The path of the directory may be relative to the working directory."""

    directory: Annotated[Path, AfterValidator(from_home)] = Field(
        default=Path("out"), description="the path of a directory (text)"
    )  # default: out/<job file stem>
    fields: Annotated[tuple[FieldName, ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of fields"
    )
    every: Count = Field(default=1, description="a positive whole number of steps")
    energy: Flag = False
    branch_dissipation: Flag = False

    foreign = MappingProxyType({"mesh_check": Instead(MEASURE_MESH)})
    rules = (*rules_of(_needs_energy), _different("fields"))

    @property
    def maps(self) -> tuple[str, ...]:
        """Return the names of the maps of all fields; a vector has one map for each component."""
        return tuple(name for field in self.fields for name in components_of(field))


class Checkpoint(Part):
    """Intervals between checkpoints, in steps or in wall time, and the number of checkpoints that are kept."""

    every: Count | None = Field(default=None, description="a positive whole number of steps")
    minutes: Positive | None = Field(default=None, description="a positive wall time in minutes [min]")
    keep: Whole = Field(default=2, ge=0, description="a whole number of checkpoints, zero or more")

    at_most_one = (("every", "minutes"),)

    @classmethod
    def filled(cls, data: dict[str, Any], context: Origin | None) -> dict[str, Any]:
        """Return the keys of the section. If the section gives no interval, an interval of 10 minutes is added."""
        return data if data.keys() & {"every", "minutes"} else {"minutes": 10.0, **data}


LADDERS = ("mesh", "cells_per_step", "integrator")
SWEPT = "it was removed; compare values of numerics.{} by a `sweep:`"


def _some_ladder(*ladders: tuple[Any, ...]) -> Iterator[Fault]:
    if not any(ladders):
        yield Fault(f"needs at least one ladder: {', '.join(LADDERS)}")


class Study(Part):
    """Settings whose values `parcontact study` compares. A list of values is the ladder of a setting. A setting without
    a ladder keeps the value of the job."""

    mesh: Annotated[tuple[Count, ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of positive whole numbers of points along x"
    )
    cells_per_step: Annotated[tuple[Positive, ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of positive numbers of cells (fractions are allowed)"
    )
    integrator: Annotated[tuple[Integrator, ...], BeforeValidator(listed)] = ()

    foreign = MappingProxyType({key: Instead(SWEPT.format(key)) for key in ("tolerance", "precision", "kernel")})
    rules = (*map(_different, LADDERS), Rule(LADDERS, _some_ladder))


LEAST_WAVES = 2  # longest waves along a box whose cells of wavenumbers do not reach 0
LEAST_CELLS = 2.0  # accuracy: least cells per shortest wave of a band (Nyquist)


class Bands(Part):
    """Bands of the spectrum of a surface. Keys that are not given follow from `numerics.accuracy`."""

    count: Annotated[int, Field(ge=1, le=100)] | None = Field(
        default=None, description="a whole number of bands from 1 to 100"
    )
    points: Annotated[tuple[Count, Count], BeforeValidator(both)] | None = Field(
        default=None, description="a positive whole number of points"
    )
    waves: Annotated[Whole, Field(ge=LEAST_WAVES)] | None = Field(
        default=None, description="a whole number of at least 2 of the longest waves of a band along a side of its box"
    )
    samples: Count | None = Field(default=None, description="a positive whole number of surfaces of each band")
    cutoff_slope: Positive | None = Field(default=None, description="a positive rms slope [-]")


def _choose(value: Any, info: ValidationInfo) -> Bands | Auto:
    if value == AUTO:
        return AUTO
    if isinstance(value, str):
        refuse(Fault(f"must be auto, or a mapping with count, points and waves, got {value!r}"))
    return Bands.model_validate(value, context=info.context)


SomeBands = Annotated[Bands | Auto, PlainValidator(_choose, json_schema_input_type=Bands | Auto)]


def _no_study(bands: Any, study: Any) -> Iterator[Fault]:
    if bands is not None and study:
        yield Fault("cannot be used with bands: a study refines one grid; compare bands.points by a sweep", ("study",))


def _over_time(bands: Any, history: Any, initial: Any, output: Any) -> Iterator[Fault]:
    """Check that bands can be marched through a history: under one pressure, along x, with steps of their own."""
    if bands is None or not history or None in history:
        return
    load = "must be the same pressure in all stages of a job in bands, whose bands are marched at fixed pressures"
    no_pressure = "cannot be used with bands, which have boxes of their own: give a pressure"
    for index, stage in enumerate(history):
        place = ("history", index)
        if stage.frequency:
            yield Fault("cannot oscillate in a job in bands, which are marched through slides and rests", place)
            continue
        if stage.control != "pressure":
            yield Fault(no_pressure, (*place, stage.control))
        elif not stage.load.constant or stage.load.start != (history[0].pressure or stage.load).start:
            yield Fault(load, (*place, "pressure"))
        elif not stage.load.start > 0.0:
            yield Fault("must be positive in a job in bands", (*place, "pressure"))
        if stage.velocity[1]:
            yield Fault("must be along x in a job in bands, whose surfaces are isotropic", (*place, "velocity"))
        for key in (key for key in ("time_step", "cells_per_step") if getattr(stage, key) not in (None, AUTO)):
            yield Fault("cannot be used with bands, whose steps follow their own cells; leave it out", (*place, key))
    if initial.state == "steady" and initial.pressure != history[0].load.start:
        yield Fault("must be the pressure of the history in a job in bands", ("initial", "pressure"))
    if initial.state == "steady" and (initial.velocity[1] or not initial.velocity[0]):
        yield Fault("must be along x, and not zero, in a job in bands", ("initial", "velocity"))
    if output.energy:
        yield Fault(
            "cannot be used with bands: the work on finer bands is in no band; leave it out", ("output", "energy")
        )


BAND_RULES = rules_of(_over_time, _no_study)
