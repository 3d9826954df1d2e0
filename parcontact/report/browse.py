"""Maps that are browsed over time or velocity: one small picture for each saved instant, inside the page."""

import io
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from PIL import Image

from .. import progress
from ..plotting import style, units
from ..plotting.frames import Frames
from ..plotting.run import Fields, Run, box, frame_label
from ..storage import hdf5
from .parts import RC, Browser, uri_of

MAPS = ("pressure", "gap", "displacement", "height")
MOST = 24  # pictures of one map: instants in between are left out
DPI = 100
COLORS = 256  # of a picture: less than half of the bytes that true colours need, and one does not see it
SIZE = (4.2, 3.5)  # [inch]

Labels = dict[int, str]  # of the maps that were saved, by their index


def of_run(run: Run) -> list[Browser]:
    """Of all maps that a run has saved, over time."""
    return list(_of(run.directory / "fields.h5", partial(_instants, run)))


def of_curve(directory: Path) -> list[Browser]:
    """Of all maps that a friction curve has saved in a directory, over velocity and load."""
    return list(_of(directory / "steady.h5", partial(_states, box(directory))))


def _of(path: Path, label: Callable[[h5py.File], Labels]) -> Iterator[Browser]:
    """None where the file is missing or cannot be read: a report tells what there is."""
    found: list[Browser] = []
    try:
        with h5py.File(path, "r", locking=False) as file:
            labels = label(file)
            chosen = _spread(list(labels))
            for name in MAPS:
                if name in file and chosen:
                    found.append(_browser(file, name, {index: labels[index] for index in chosen}))
    except hdf5.FAILURES:
        pass
    yield from found


def _browser(file: h5py.File, name: str, labels: Labels) -> Browser:
    with style.drawing(RC):
        frames = Frames(file, name, list(labels), SIZE)
        uris = []
        for index, label in progress.shown(list(labels.items()), f"maps of {name}", "map"):
            frames.show(index, f"{name}, {label}")
            image = io.BytesIO()
            frames.figure.savefig(image, format="png", dpi=DPI)
            uris.append(uri_of(fewer_colours(image), "image/png"))
    return Browser(name, list(labels.values()), uris)


def fewer_colours(png: io.BytesIO) -> bytes:
    """The picture with so few colours that all of it, also what is rare, has nearly its own."""
    small, true = io.BytesIO(), Image.open(png).convert("RGB")
    few = true.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(small, "png", optimize=True)
    return small.getvalue()


def _spread(indices: Sequence[int]) -> list[int]:
    """At most so many of them, the first and the last among them."""
    count = min(len(indices), MOST)
    return [indices[int(k)] for k in np.linspace(0, len(indices) - 1, count)] if count else []


def _instants(run: Run, file: h5py.File) -> Labels:
    fields = Fields(file)
    return {index: frame_label(run, fields, index) for index in fields.saved}


def _states(area: float, file: h5py.File) -> Labels:
    """Speeds and loads: forces on the box of a free scene, whose `area` [m^2] is not 0."""
    speeds, loads = file["velocity"][...], file["load"][...]
    known = np.flatnonzero(~np.isnan(speeds))
    warm = (
        [f", {degrees:g} °C" for degrees in file["temperature"][...]] if "temperature" in file else [""] * len(speeds)
    )
    size, unit = (area, "N") if area else (1.0, "Pa")
    pressed = [units.text(size * float(load), unit) for load in loads]
    return {int(k): f"{units.text(float(speeds[k]), 'm/s')}, {pressed[k]}{warm[k]}" for k in known}
