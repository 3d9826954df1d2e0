"""Pressures on a line: along a narrow map, or through the axis of a sphere or cylinder."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from ..job import Cylinder, Elastic, Job, Sphere
from ..parallel.slab import Array
from ..theory import hertz
from . import style, units
from .run import Fields, Panel, Run

INSTANTS = 5  # at most so many lines in one panel


@dataclass(frozen=True)
class Curve:
    """Pressures [Pa] on a line [m] at an instant."""

    name: str
    along: Array
    pressure: Array


def _chosen(run: Run, fields: Fields) -> tuple[list[tuple[int, str]], str]:
    """Some of the saved instants, evenly, and what tells them apart; and the load of all if it is one, for a title."""
    indices = sorted({fields.shown[int(k)] for k in np.linspace(0, len(fields.shown) - 1, INSTANTS)})
    steps = [int(fields.steps[index]) for index in indices]
    loads = {run.pressed(step) for step in steps}
    if run.lasts and len(loads) == 1:
        return [(index, units.text(float(fields.times[index]), "s")) for index in indices], f", {loads.pop()}"
    return [(k, run.instant(step, float(fields.times[k]))) for k, step in zip(indices, steps, strict=True)], ""


def _draw_curves(axes: Axes, curves: Sequence[Curve]) -> tuple[float, float]:
    """Draw pressures on lines; returns the units of length [m] and pressure [Pa]."""
    length, distances = units.scaled("m", *(curve.along for curve in curves))
    unit, pressures = units.scaled("Pa", *(curve.pressure for curve in curves))
    for number, (curve, x, p) in enumerate(zip(curves, distances, pressures, strict=True)):
        shade = 0.85 * number / (len(curves) - 1) if len(curves) > 1 else 0.45
        axes.plot(x, p, color=colormaps[style.SEQUENCE](shade), label=curve.name)
    axes.set(xlabel=f"[{length}]", ylabel=f"pressure [{unit}]")
    axes.locator_params(nbins=5)
    return units.size_of(length, "m"), units.size_of(unit, "Pa")


def strips(run: Run, fields: Fields) -> Panel:
    """Pressures along the long side of a narrow map."""
    lies = fields.x.size > fields.y.size
    chosen, load = _chosen(run, fields)
    curves = []
    for index, name in chosen:
        field = fields.file["pressure"][index]
        curves.append(Curve(name, fields.x if lies else fields.y, field[0] if lies else field[:, 0]))

    def draw(axes: Axes) -> None:
        _draw_curves(axes, curves)
        axes.set_xlabel(("x " if lies else "y ") + axes.get_xlabel())
        some = "some of the " if len(curves) < len(fields.shown) else "the "
        axes.set_title(f"pressure at {some}saved instants{load}" if run.lasts else f"pressure under {some}loads")
        axes.legend(**style.BESIDE)

    return draw


def profiles(run: Run, fields: Fields, shape: Sphere | Cylinder) -> Panel:
    """Pressures along a line through the axis, seen from the axis, beside Hertz's under the last load."""
    across = isinstance(shape, Cylinder) and shape.axis == "x"
    centre = shape.center or (run.job.grid.lx / 2, run.job.grid.ly / 2)
    chosen, load = _chosen(run, fields)
    curves = []
    for index, name in chosen:
        moved = run.moved(int(fields.steps[index]))
        x, y, field = fields.x - centre[0] - moved[0], fields.y - centre[1] - moved[1], fields.file["pressure"][index]
        line = field[:, np.argmin(np.abs(x))] if across else field[np.argmin(np.abs(y))]
        curves.append(Curve(name, y if across else x, line))
    force = float(field.mean() * run.area)
    reach = 1.3 * max(float(np.abs(curve.along[curve.pressure > 0.0]).max(initial=0.0)) for curve in curves)

    def draw(axes: Axes) -> None:
        length, unit = _draw_curves(axes, curves)
        if isinstance(shape, Sphere) and force > 0.0:
            r = np.linspace(-reach, reach, 401)
            for name, modulus, dashes in _moduli(run.job):
                pressure = hertz.pressure(np.abs(r), force, shape.radius, modulus, run.job.material.poisson)
                axes.plot(r / length, pressure / unit, "k" + dashes, lw=1.0, label=name)
        axes.set_xlabel(f"{'y' if across else 'x'} from the axis {axes.get_xlabel()}")
        axes.set_title(f"pressure on a line through the axis{load}")
        if reach > 0.0:
            axes.set_xlim(-reach / length, reach / length)
        axes.set_ylim(bottom=0.0)
        axes.legend(**style.BESIDE)

    return draw


def _moduli(job: Job) -> list[tuple[str, float, str]]:
    """Of the elastic bodies to compare with, and how they are drawn."""
    material = job.material
    if isinstance(material, Elastic):
        return [("Hertz", material.shear_modulus, "--")]
    ends = [("Hertz, G(0)", material.instant_modulus, "--"), ("Hertz, G(∞)", material.long_modulus, ":")]
    return [end for end in ends if end[1] > 0.0]
