"""A movie of a map over its saved instants, as a GIF with one range of colours."""

from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np
from matplotlib.animation import PillowWriter
from PIL import Image

from ..errors import InputError
from ..storage import files, hdf5
from .frames import Frames
from .run import Fields, Run, frame_label

FRAMES = 200  # at most: instants in between are left out
SECONDS = 8.0  # for which it plays, unless its frames are too few
FASTEST, SLOWEST = 20, 2  # frames per second


class Writer(PillowWriter):
    """Writes a GIF that is known as one of this program, whatever the name of its file."""

    _frames: list[Image.Image]

    def finish(self) -> None:
        first, *others = self._frames
        time = int(1000 / self.fps)  # ms
        shown = {"append_images": others, "duration": time, "loop": 0}
        first.save(self.outfile, "GIF", save_all=True, comment=files.MARK.encode(), **shown)


def make(directory: Path, name: str, target: Path) -> Path:
    """Draw all saved instants of a map; returns the movie's path. Raises InputError where there is none."""
    path = directory / "fields.h5"
    try:
        with h5py.File(path, "r", locking=False) as file:
            fields = Fields(file)
            there = [key for key in ("pressure", "displacement", "gap", "height") if key in file]
            if name not in there or not fields.saved:
                raise InputError(f"{path} holds no map of {name}; it holds {', '.join(there) or 'none'}")
            with files.replaced(target, files.is_marked) as movie:
                _make(Run(directory), fields, name, movie)
    except hdf5.FAILURES as error:
        raise InputError(f"no movie from {path}: {hdf5.reason(error)}") from error
    return target


def _make(run: Run, fields: Fields, name: str, movie: BinaryIO) -> None:
    count = min(len(fields.saved), FRAMES)
    chosen = [fields.saved[int(k)] for k in np.linspace(0, len(fields.saved) - 1, count)]
    frames = Frames(fields.file, name, chosen)
    writer = Writer(fps=min(max(round(count / SECONDS), SLOWEST), FASTEST))
    with writer.saving(frames.figure, movie.name, dpi=110):
        for index in chosen:
            frames.show(index, f"{name}, {frame_label(run, fields, index)}")
            writer.grab_frame()
