"""Charts of pressure, and of traction, along a line: of a narrow map, or through the axis of a sphere or cylinder."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from ..job import Cylinder, Elastic, Sphere
from ..parallel.slab import Array
from ..theory import hertz
from . import prefixes, style
from .plotted_run import Fields, PlottedRun

INSTANTS = 5  # most lines in a panel
MOST_LETTERS = 30  # most letters of the name of a stage in a legend
RANGE = 1.3  # shown range over the radius of contact

Curve = tuple[str, Array, Array]  # name, positions [m] and pressures [Pa]


def line_panels(run: PlottedRun, fields: Fields, narrow: bool) -> Iterator[style.Panel]:
    """Yield the panel of a narrow map, or of a surface that is a single round shape."""
    shape = run.job.surface[0]
    if narrow:
        yield _make_strip(run, fields)
    elif len(run.job.surface) == 1 and isinstance(shape, Sphere | Cylinder):
        yield _make_profile(run, fields, shape)


def _choose_instants(run: PlottedRun, fields: Fields) -> tuple[list[tuple[int, str]], str]:
    """Return some evenly spaced saved instants with their labels, and the load for the title if it is the same at
    all."""
    indices = sorted({fields.shown[int(k)] for k in np.linspace(0, len(fields.shown) - 1, INSTANTS)})
    instants = [(index, int(fields.steps[index]), float(fields.times[index])) for index in indices]
    loads = {run.pressed(step) for _, step, _ in instants}
    same_load = run.lasts and len(loads) == 1
    names = []
    for index, step, time in instants:
        stage = style.plain(run.name_stage(step), MOST_LETTERS)
        when = prefixes.quantity(time, "s") if same_load else run.instant(step, time)
        names.append((index, "\n".join(filter(None, (stage, when)))))
    return names, f", {loads.pop()}" if same_load else ""


def _draw_pressures(
    axes: Axes, curves: Sequence[Curve], along: str, title: str, theory: Sequence[Curve] = (), reach: float = 0.0
) -> None:
    """Draw pressures on lines up to `reach` on both sides, if given, with the theory."""
    shades = np.linspace(0.0, 0.85, len(curves)) if len(curves) > 1 else [0.45]
    for (name, x, pressure), shade in zip(curves, shades, strict=True):
        axes.plot(x, pressure, color=colormaps[style.SEQUENCE](shade), label=name)
    for (name, x, pressure), dashes in zip(theory, ("--", ":"), strict=False):
        axes.plot(x, pressure, "k" + dashes, lw=1.0, label=name)
    if reach:
        axes.set_xlim(-reach, reach)
    if not any((pressure < 0.0).any() for _, _, pressure in curves):
        axes.set_ylim(bottom=0.0)
    axes.set_title(title)
    axes.locator_params(nbins=5)
    prefixes.label(axes.xaxis, along, "m")
    prefixes.label(axes.yaxis, "pressure", "Pa")


def _make_strip(run: PlottedRun, fields: Fields) -> style.Panel:
    """Return a panel of pressures along the long side of a narrow map."""
    lies = fields.x.size > fields.y.size
    chosen, load = _choose_instants(run, fields)
    maps = [(name, fields.file["pressure"][index]) for index, name in chosen]
    curves = [(name, fields.x, field[0]) if lies else (name, fields.y, field[:, 0]) for name, field in maps]
    some = "some of the " if len(curves) < len(fields.shown) else "the "
    title = f"pressure at {some}saved instants{load}" if run.lasts else f"pressure under {some}loads"
    return partial(_draw_pressures, curves=curves, along="x" if lies else "y", title=title)


def traction_panels(run: PlottedRun, fields: Fields) -> Iterator[style.Panel]:
    """Yield the panel of tractions along the long side of a narrow map at the chosen instant, if they are saved. With a
    coefficient of friction it has the bounds."""
    lies = fields.x.size > fields.y.size
    along, place = ("x", fields.x) if lies else ("y", fields.y)
    traction, pressure = fields.read(f"traction_{along}"), fields.read("pressure")
    if traction is None or pressure is None:
        return
    t, p = (field[0] if lies else field[:, 0] for field in (traction, pressure))
    instant = run.instant(int(fields.steps[fields.chosen]), float(fields.times[fields.chosen]))
    bound = run.job.section("interface").coefficient
    touched = place[p > 0.0]

    def draw(axes: Axes) -> None:
        axes.plot(place, t, color=style.BLUE, label="traction")
        for sign, name in ((1, "bound"), (-1, "")) if bound is not None else ():
            axes.plot(place, sign * bound * p, "k:", lw=1.0, label=name)
        if touched.size:
            margin = 0.15 * np.ptp(touched)
            axes.set_xlim(touched.min() - margin, touched.max() + margin)
        axes.set_title(f"traction along {along}, {instant}")
        axes.locator_params(nbins=5)
        prefixes.label(axes.xaxis, along, "m")
        prefixes.label(axes.yaxis, "traction", "Pa")

    yield draw


def _make_profile(run: PlottedRun, fields: Fields, shape: Sphere | Cylinder) -> style.Panel:
    """Return a panel of pressures on a line through the axis, with Hertz's pressure under the last load."""
    across = isinstance(shape, Cylinder) and shape.axis == "x"
    centre = shape.center or (run.job.grid.lx / 2, run.job.grid.ly / 2)
    chosen, load = _choose_instants(run, fields)
    curves: list[Curve] = []
    for index, name in chosen:
        moved = run.moved(int(fields.steps[index]))
        x, y, field = fields.x - centre[0] - moved[0], fields.y - centre[1] - moved[1], fields.file["pressure"][index]
        line = field[:, np.argmin(np.abs(x))] if across else field[np.argmin(np.abs(y))]
        curves.append((name, y if across else x, line))
    force = float(field.mean() * run.area)
    reach = RANGE * max(float(np.abs(along[pressure > 0.0]).max(initial=0.0)) for _, along, pressure in curves)
    theory: list[Curve] = []
    if isinstance(shape, Sphere) and force > 0.0:
        r, poisson = np.linspace(-reach, reach, 401), run.job.material.poisson
        for name, modulus in _find_moduli(run):
            theory.append((name, r, hertz.pressure(np.abs(r), force, shape.radius, modulus, poisson)))
    along, title = f"{'y' if across else 'x'} from the axis", f"pressure on a line through the axis{load}"
    return partial(_draw_pressures, curves=curves, along=along, title=title, theory=theory, reach=reach)


def _find_moduli(run: PlottedRun) -> list[tuple[str, float]]:
    """Return the shear moduli [Pa] of the elastic bodies to compare with."""
    material = run.job.material.fitted
    if isinstance(material, Elastic):
        return [("Hertz", material.shear_modulus)]
    ends = ("Hertz, G(0)", material.instant_modulus), ("Hertz, G(∞)", material.long_modulus)
    return [end for end in ends if end[1] > 0.0]
