"""Maps that are browsed over time or velocity: one small picture for each saved instant, inside the page."""

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from PIL import Image

from .. import progress
from ..plotting import maps, style, units
from ..plotting.plots import spread
from ..plotting.run import Run, box, frame_labels, load_of
from ..storage import hdf5
from .parts import RC, Browser, uri_of

MOST = 24  # pictures of one map: instants in between are left out
DPI = 100
COLORS = 256  # of a picture: less than half of the bytes that true colours need, and one does not see it
SIZE = (4.2, 3.5)  # [inch]


def of_run(run: Run) -> list[Browser]:
    """Return all maps that a run has saved, over time."""
    return _browsers(run.directory / "fields.h5", partial(frame_labels, run))


def of_curve(directory: Path) -> list[Browser]:
    """Return all maps that a friction curve has saved in a directory, over velocity and load."""
    return _browsers(directory / "steady.h5", partial(_states, box(directory)))


def _browsers(path: Path, label: Callable[[h5py.File], dict[int, str]]) -> list[Browser]:
    """Return none where the file is missing or cannot be read: a report tells what there is."""
    try:
        with h5py.File(path, "r", locking=False) as file, style.drawing(RC):
            labels = spread(label(file), MOST)
            return [_browser(file, name, labels) for name in maps.LOOKS if name in file and labels]
    except hdf5.FAILURES:
        return []


def _browser(file: h5py.File, name: str, labels: dict[int, str]) -> Browser:
    counted = progress.with_bar(list(labels), f"maps of {name}", "map")
    images = zip(maps.frames(file, name, labels, SIZE, DPI), counted, strict=True)
    return name, [(uri_of(small_png(image), "image/png"), labels[index]) for image, index in images]


def small_png(image: Image.Image) -> bytes:
    """Return a picture with so few colours that all of it, also what is rare, has nearly its own."""
    png = io.BytesIO()
    few = image.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(png, "png", optimize=True)
    return png.getvalue()


def _states(area: float, file: h5py.File) -> dict[int, str]:
    """Return speeds and loads of the states that are saved: forces on the box of a free scene of this `area` [m^2]."""
    speeds = file["velocity"][...]
    axis, loads = load_of(file["load"][...], area)
    warm = [f", {t:g} °C" for t in file["temperature"][...]] if "temperature" in file else [""] * speeds.size
    known = np.flatnonzero(~np.isnan(speeds)).tolist()
    return {k: f"{units.text(speeds[k], 'm/s')}, {units.text(loads[k], axis.unit)}{warm[k]}" for k in known}
