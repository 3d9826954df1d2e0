"""Movies of a map over its saved instants: a GIF, and an MP4 if `ffmpeg` is on the path."""

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from ..errors import InputError
from ..storage import files, hdf5
from . import maps
from .plotted_run import PlottedRun, choose_evenly, label_frames

FRAMES = 200  # most frames of a movie; other instants are left out
SECONDS = 8.0  # duration of a movie with enough frames [s]
FASTEST, SLOWEST = 20, 2  # limits on the frames per second
FFMPEG, KINDS = "ffmpeg", (".gif", ".mp4")


def write_movie(directory: Path, name: str, out: Path | None = None) -> list[Path]:
    """Write a movie of the map `name` over all saved instants, with one range of colours; returns the paths.

    Without `out` they are NAME.gif in the directory, and NAME.mp4 if ffmpeg exists. Raises InputError for another kind
    of file, an MP4 without ffmpeg, and a map that was not saved.
    """
    targets = [out] if out else [directory / f"{name}{kind}" for kind in KINDS if kind == ".gif" or _find_ffmpeg()]
    if targets[0].suffix not in KINDS:
        raise InputError(f"--movie writes a GIF or an MP4: --out must end in .gif or .mp4, got {targets[0]}")
    if targets[0].suffix == ".mp4" and not _find_ffmpeg():
        raise InputError(f"an MP4 needs the program {FFMPEG} on the path; give an --out that ends in .gif")
    try:
        frames, rate = _draw(directory, name)
    except hdf5.FAILURES as error:
        raise InputError(f"no movie from {directory / 'fields.h5'}: {hdf5.reason(error)}") from error
    for target in targets:
        _write_gif(target, frames, rate) if target.suffix == ".gif" else _write_mp4(target, frames, rate)
    return targets


def _find_ffmpeg() -> str | None:
    return shutil.which(FFMPEG)


def _draw(directory: Path, name: str) -> tuple[list[Image.Image], int]:
    """Return the frames, and their rate [1/s]."""
    path = directory / "fields.h5"
    run = PlottedRun(directory)
    with run.open_maps() as file:
        labels = label_frames(run, file)
        there = maps.drawn_maps(file)
        if name not in there or not labels:
            raise InputError(f"{path} has no map of {name}; it has {', '.join(there) or 'none'}")
        chosen = choose_evenly(labels, FRAMES)
        rate = int(np.clip(round(len(chosen) / SECONDS), SLOWEST, FASTEST))
        return list(maps.draw_frames(file, name, chosen, run.job)), rate


def _write_gif(target: Path, frames: Sequence[Image.Image], rate: int) -> None:
    first, *others = frames
    with files.replaced(target, files.is_marked) as movie:
        duration, comment = int(1000 / rate), files.MARK.encode()  # duration of a frame [ms]
        first.save(movie, "GIF", save_all=True, append_images=others, duration=duration, loop=0, comment=comment)


def _write_mp4(target: Path, frames: Sequence[Image.Image], rate: int) -> None:
    """Encode the frames by ffmpeg, with even numbers of points along each side, as players require."""
    width, height = (2 * (side // 2) for side in frames[0].size)
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(rate), "-i", "-"]
    look = ["-pix_fmt", "yuv420p", "-metadata", f"comment={files.MARK}", "-movflags", "+faststart", "-f", "mp4"]
    with files.replaced(target, files.is_marked) as movie:
        command = [_find_ffmpeg() or FFMPEG, "-v", "error", "-y", *raw, *look, f"file:{Path(movie.name).absolute()}"]
        pictures = b"".join(frame.crop((0, 0, width, height)).tobytes() for frame in frames)
        done = subprocess.run(command, input=pictures, capture_output=True, check=False)
        if done.returncode:
            why = (done.stderr.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
            raise InputError(f"{FFMPEG} cannot write {target}: {why}")
