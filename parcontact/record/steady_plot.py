"""A picture of steady.csv: friction and contact area over velocity, or over pressure where that is what changes."""

from pathlib import Path

from . import measures


def plot(table: Path) -> Path:
    """Draw a table of steady states beside it; returns the picture's path."""
    from matplotlib.figure import Figure  # slow to import, and for pictures only

    columns = measures.read(table)
    picture = table.with_suffix(".png")
    velocities, pressures = sorted(set(columns["velocity"])), _distinct(columns["pressure"])
    over, other = ("velocity", "pressure") if len(velocities) > 1 else ("pressure", "velocity")
    axis = "sliding velocity [m/s]" if over == "velocity" else "pressure [Pa]"
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for value in pressures if other == "pressure" else velocities:
        rows = [k for k, found in enumerate(columns[other]) if abs(found - value) <= 1e-6 * value]
        label = f"{value / 1e6:g} MPa" if other == "pressure" else f"{value:g} m/s"
        x = [columns[over][k] for k in rows]
        left.plot(x, [columns["friction"][k] for k in rows], "o-", ms=3, label=label)
        right.plot(x, [columns["contact_area"][k] for k in rows], "o-", ms=3, label=label)
    for axes, name in ((left, "friction coefficient"), (right, "contact area / nominal area")):
        axes.set(xscale="log", xlabel=axis, ylabel=name)
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.3)
    left.legend(title="pressure" if other == "pressure" else "velocity", frameon=False)
    figure.savefig(picture, dpi=150)
    return picture


def _distinct(values: list[float]) -> list[float]:
    """Sorted values; those that differ by round-off only are one."""
    found: list[float] = []
    for value in sorted(values):
        if not found or value - found[-1] > 1e-6 * value:
            found.append(value)
    return found
