"""FFTW's wisdom, kept: it finds the fastest transforms by trying, and others give other last digits.

So that a run repeated on the same machine gives the same digits, the first choice for a kind of run is kept in the
user's private cache directory; so that a run continued anywhere does, checkpoints carry it too.
"""

import hashlib
import json
import os
import platform
import zlib
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import private
from ..parallel import fft
from ..parallel.fft import export_wisdom, import_wisdom
from ..parallel.fftw import pyfftw
from ..parallel.slab import Slab

CPUINFO = Path("/proc/cpuinfo")


def gather(slab: Slab) -> NDArray[np.uint8]:
    """The wisdom of all ranks, for a checkpoint; collective."""
    everyone = [wisdom.decode("latin-1") for wisdom in slab.from_all(export_wisdom())]
    different = list(dict.fromkeys(everyone))
    text = json.dumps({"plans": different, "of": [different.index(wisdom) for wisdom in everyone]})
    return np.frombuffer(zlib.compress(text.encode()), dtype=np.uint8)


def recall(transforms: Sequence[Any], slab: Slab, saved: NDArray[np.uint8] | None) -> None:
    """Use the wisdom of a checkpoint, if it is of as many ranks, else that of the first run here with such
    `transforms` (`scene.Choices`); collective."""
    data = None if saved is None else saved.tobytes()
    if not _adopt(data, slab):
        _adopt(slab.agree(_read(_place(transforms, slab)) if slab.root else None), slab)


def keep(transforms: Sequence[Any], slab: Slab) -> None:
    """Keep the wisdom of this run for later ones, unless there is some; collective."""
    data = gather(slab).tobytes()
    if slab.root:
        with suppress(OSError):  # a convenience: a run without a place for it does as well
            if place := _place(transforms, slab):
                part = place.with_name(f"{place.name}.{os.getpid()}")
                part.write_bytes(data)
                try:
                    os.link(part, place)  # the first one stays
                except FileExistsError:
                    pass
                finally:
                    part.unlink()


def _adopt(data: bytes | None, slab: Slab) -> bool:
    if data is None:
        return False
    try:
        kept = json.loads(zlib.decompress(data))
        ranks, plans = kept["of"], kept["plans"]
        return len(ranks) == slab.comm.size and import_wisdom(plans[ranks[slab.comm.rank]].encode("latin-1"))
    except (zlib.error, ValueError, KeyError, IndexError, TypeError):
        return False


def _read(place: Path | None) -> bytes | None:
    try:
        return place.read_bytes() if place and private.is_own(place) else None
    except OSError:
        return None


def _place(transforms: Sequence[Any], slab: Slab) -> Path | None:
    """A file for all runs on this kind of machine whose transforms are the same; None if there is no safe place."""
    directory = private.directory("plans")
    if directory is None:
        return None
    cpu = ""
    with suppress(OSError):
        cpu = next((line for line in CPUINFO.read_text().splitlines() if line.startswith("model name")), "")
    facts = [platform.machine(), cpu, pyfftw.fftw_version, zlib.crc32(Path(fft.__file__).read_bytes())]
    facts += [slab.comm.size, *transforms]
    name = hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:16]
    return directory / name
