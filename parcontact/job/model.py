"""A job: what is simulated and how, as frozen sections.

`Job.resolved` is the job as YAML with every default filled in; `describe` is a table of it to read. SI units
everywhere. No MPI and no maps here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Field, PrivateAttr, ValidationInfo, create_model, model_validator

from . import extension
from .checks import advice, limits, meaning, size
from .sections import height_arrays, listing
from .sections.geometry import OnOneMesh, Rough, Shape
from .sections.materials import Dma, Elastic, Material, Zener, heated
from .sections.part import Context, Part, Rule
from .sections.settings import Body, Checkpoint, Grid, Numerics, Output, Study
from .sections.stages import Initial, Stage, Steady
from .text.fault import Fault
from .text.overrides import Included
from .text.python_data import is_array
from .text.yamltext import dump


def _kernel_fits(grid: Grid, numerics: Numerics) -> Iterator[Fault]:
    if grid.boundary == "free" and numerics.kernel == "spectral":
        yield Fault("must be love when grid.boundary is free: the spectral kernel is periodic", ("numerics", "kernel"))


def _layer_is_resolved(grid: Grid, body: Body | None) -> Iterator[Fault]:
    if body is not None and grid.boundary == "free" and body.thickness < 2 * max(grid.dx, grid.dy):
        least = 2 * max(grid.dx, grid.dy)
        sentence = f"must be at least two cells, {least:.3g} m, when grid.boundary is free, got {body.thickness:g}"
        yield Fault(sentence, ("body", "thickness"))


def _no_wake_in_a_layer(grid: Grid, body: Body | None, initial: Initial, steady: Steady | None) -> Iterator[Fault]:
    if body is not None and grid.boundary == "free" and (initial.state == "steady" or steady is not None):
        yield Fault("must be periodic for steady sliding on a layer", ("grid", "boundary"))


def _waves_fit(grid: Grid, surface: tuple[Any, ...]) -> Iterator[Fault]:
    """No wave may be shorter than two cells (Nyquist), and the shortest one must fit into the box."""
    cell = max([step for step, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1], default=0.0)
    for index, shape in enumerate(surface):
        if isinstance(shape, Rough) and shape.short_wavelength < 2 * cell * (1 - advice.SAME_LENGTH):
            sentence = f"must be at least two cells, {2 * cell:.6g} m (Nyquist), got {shape.short_wavelength!r}"
            yield Fault(sentence, ("surface", index, "short_wavelength"))
        if isinstance(shape, Rough) and shape.short_wavelength > max(grid.size):
            sentence = f"must fit into the box of {max(grid.size):.6g} m, got {shape.short_wavelength!r}"
            yield Fault(sentence, ("surface", index, "short_wavelength"))
        for axis, (waves, n) in enumerate(zip(getattr(shape, "waves", ()), grid.points, strict=False)):
            if abs(waves) > n / 2:
                sentence = f"must be within {-(n // 2)} and {n // 2} waves for {n} points (Nyquist), got {waves}"
                yield Fault(sentence, ("surface", index, "waves", axis))


def _half_mesh_fits(grid: Grid, surface: tuple[Any, ...], output: Output) -> Iterator[Fault]:
    """A check of the mesh needs the same scene on half of it."""
    key = ("output", "mesh_check")
    if not output.mesh_check or next(_waves_fit(grid, surface), None):
        return
    if any(n % 2 for n in grid.points if n > 1):
        yield Fault(f"needs even numbers of grid.points, got {list(grid.points)}", key)
    for index, shape in enumerate(surface):
        if isinstance(shape, OnOneMesh):
            yield Fault(f"the heights of surface.{index} are given on one mesh, and cannot be put on half of it", key)
    half = grid.model_copy(update={"points": tuple(max(n // 2, 1) for n in grid.points)})
    for fault in _waves_fit(half, surface):
        yield Fault(f"on half the mesh {'.'.join(map(str, fault.path))} {fault.predicate}", key)


def _some_shape(surface: tuple[Any, ...]) -> Iterator[Fault]:
    if not surface:
        yield Fault("needs at least one shape; shape: flat is one", ("surface",))


def _some_history(history: tuple[Any, ...], steady: Steady | None) -> Iterator[Fault]:
    if not history and steady is None:
        yield Fault("needs at least one stage, unless there is a steady section", ("history",))
    known = steady is None or steady.pressures is not None or None in history
    if not known and not any(stage.control != "approach" and stage.load.end > 0.0 for stage in history):
        sentence = "is missing; it must be positive pressures [Pa] when no stage of the history has a pressure or force"
        yield Fault(sentence, ("steady", "pressures"))


def _some_load(history: tuple[Any, ...], initial: Initial) -> Iterator[Fault]:
    if not history or None in history or initial.pressure or any(stage.approach for stage in history):
        return
    if not any(stage.load.start or stage.load.end for stage in history):
        yield Fault("must not be zero in every stage: nothing would ever touch", ("history", 0, history[0].control))


def _steady_at_rest(initial: Initial, material: Elastic | Zener) -> Iterator[Fault]:
    if initial.state == "steady" and not any(initial.velocity) and material.long_modulus == 0:
        sentence = "must not be zero: the material has no long-term modulus, and a fluid at rest no steady contact"
        yield Fault(sentence, ("initial", "velocity"))


class Origin(NamedTuple):
    """How a job was given: from a file or as a mapping, and whether it says itself where its results go."""

    from_file: bool = True
    names_directory: bool = False


class Job(Part):
    """A whole job. Sections have the names of the job file; equal jobs may come from different files."""

    title: str = Field(default="", description="text (put numbers in quotes)")
    grid: Grid = Field(description="a mapping with points and size")
    surface: tuple[Shape, ...] = Field(description="one shape, or a list of shapes")
    material: Material = Field(description="a mapping with model: elastic | zener")
    initial: Initial = Initial()
    history: tuple[Stage, ...] = Field(default=(), description="a list of stages")
    numerics: Numerics = Numerics()
    output: Output = Output()
    checkpoint: Checkpoint = Checkpoint()
    steady: Steady | None = None
    study: Study | None = None
    body: Body | None = None

    _path: Path = PrivateAttr(default=Path("job.yaml"))
    _included: Included | None = PrivateAttr(default=None)
    _origin: Origin = PrivateAttr(default=Origin())

    rules = (
        Rule(("grid", "numerics"), _kernel_fits),
        Rule(("grid", "body"), _layer_is_resolved),
        Rule(("grid", "body", "initial", "steady"), _no_wake_in_a_layer),
        Rule(("surface",), _some_shape),
        Rule(("grid", "surface"), _waves_fit),
        Rule(("grid", "surface"), height_arrays.fit),
        Rule(("grid", "surface", "output"), _half_mesh_fits),
        Rule(("history", "steady"), _some_history),
        Rule(("history", "initial"), _some_load),
        Rule(("initial", "material"), _steady_at_rest),
        Rule(("grid", "material", "history", "initial", "steady"), limits.of_hardness),
        Rule(("grid", "history"), limits.of_steps),
    )

    @classmethod
    def filled(cls, data: dict[str, Any], context: Context | None) -> dict[str, Any]:
        """Numbers unnamed stages, chooses the kernel by the boundary, and names the output after the job file."""
        if isinstance(data.get("surface"), dict | list) or is_array(data.get("surface")):
            data["surface"] = height_arrays.with_shapes(data["surface"])
        if isinstance(data.get("history"), list):
            data["history"] = [_named(stage, index) for index, stage in enumerate(data["history"])]
        free = isinstance(data.get("grid"), dict) and data["grid"].get("boundary") == "free"
        _default(data, "numerics", "kernel", "love" if free else "spectral")
        _default(data, "output", "directory", str(Path("out", context.path.stem if context else "job")))
        return data

    @model_validator(mode="wrap")
    @classmethod
    def _with_sections_of_effects(cls, data: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
        """A job that has the section of an effect is of a model that knows it."""
        if cls is Job and isinstance(data, dict):
            others = [key for key, value in data.items() if key not in cls.model_fields and value is not None]
            if added := extension.effects_of(others):
                return extended(tuple(sorted(added))).model_validate(data, context=info.context)
        return handler(data)

    def model_post_init(self, context: Any) -> None:
        """Keeps the path of the job file, and that of its material."""
        if isinstance(context, Context):
            self._path, self._included = context.path, context.included

    @classmethod
    def words(cls) -> tuple[str, ...]:
        """The sections, and the sweep, which is gone once a case is read."""
        return (*super().words(), "sweep")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Job) and dict(self) == dict(other)

    def __hash__(self) -> int:
        return hash(self.resolved())

    @property
    def path(self) -> Path:
        """The job file (absolute)."""
        return self._path

    @property
    def origin(self) -> Origin:
        """How the job was given."""
        return self._origin

    def of(self, origin: Origin, path: Path | None = None) -> Job:
        """The same job, given otherwise, or from another file."""
        copy = self.model_copy()
        copy._origin, copy._path = origin, path or self._path
        return copy

    @property
    def included(self) -> Included | None:
        """The file from which the material comes, if it is not in the job file."""
        return self._included

    @property
    def directory(self) -> Path:
        """Where the job file is; files named in the job are looked for from here."""
        return self._path.parent

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is allowed but will probably disappoint; errors with `numerics.strict`."""
        material = self.material.fitted if isinstance(self.material, Dma) else self.material
        scene = self.grid, self.surface, material, self.history
        return (
            *(self.material.doubts if isinstance(self.material, Dma) else ()),
            *advice.resolution(*scene, self.numerics),
            *meaning.warnings(*scene, self.initial, self.steady),
            *size.warnings(self.grid, limits.count_steps(self.grid, self.history), self.output),
        )

    @property
    def measured(self) -> bool:
        """Whether the material says at which frequencies or temperatures it was measured."""
        body = self.material.fitted if isinstance(self.material, Dma) else self.material
        return isinstance(body, Zener) and (body.band is not None or body.temperatures is not None)

    def at_temperature(self, temperature: float) -> Job:
        """The same job with its material at another temperature [deg C]; raises InputError where it has no shift."""
        return self.model_copy(update={"material": heated(self.material, temperature)})

    def section(self, name: str) -> Any:
        """The section that an effect has added, None if this job has not given it."""
        return getattr(self, name, None)

    @property
    def remembers(self) -> bool:
        """Whether the body has a memory, and time steps an error: an elastic one has neither."""
        return not isinstance(self.material, Elastic) and bool(getattr(self.material, "branches", True))

    def resolved(self) -> str:
        """YAML text with every default filled in; it loads back to an equal job, where the files that it names are."""
        return dump(listing.plain(self))


SEPARATOR = ":"  # of sections in the name of an extended job, by which other ranks find its class


@cache
def extended(sections: tuple[str, ...]) -> type[Job]:
    """The model of a job that may have these sections of effects too."""
    effects = extension.effects_of(sections)
    fields: dict[str, Any] = {
        name: (effect.section | None, Field(default=None, description="a mapping of keys"))
        for name, effect in effects.items()
    }
    made = create_model(SEPARATOR.join(("Job", *sections)), __base__=Job, __module__=__name__, **fields)
    made.rules = (*Job.rules, *(rule for effect in effects.values() for rule in getattr(effect, "rules", ())))
    return made


def __getattr__(name: str) -> Any:
    """The class of an extended job, where a job of another rank arrives."""
    head, *sections = name.split(SEPARATOR)
    if head == "Job" and sections:
        return extended(tuple(sections))
    raise AttributeError(name)


def _named(stage: Any, index: int) -> Any:
    return {**stage, "name": f"stage {index + 1}"} if isinstance(stage, dict) and stage.get("name") is None else stage


def _default(data: dict[str, Any], section: str, key: str, value: Any) -> None:
    given = data.get(section, {})
    if isinstance(given, dict) and given.get(key) is None:
        data[section] = {**given, key: value}


def describe(job: Job) -> str:
    """A table of the job with every default and its unit; times and cells that follow from it come last."""
    rows = list(listing.rows(job))
    rows.append(("cell", listing.text((job.grid.dx, job.grid.dy)), "m"))
    seconds = math.fsum(stage.seconds for stage in job.history)
    rows.append(("time", listing.text(seconds), "s"))
    return listing.layout(rows)
