"""FFTW's wisdom (choices of fastest transforms, found by timing), stored so that repeated runs give the same digits.

The first choice for a kind of run is stored in the user's private cache directory, and in checkpoints, so that a run
can continue on another machine.
"""

import hashlib
import json
import platform
import zlib
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import compiled
from ..parallel import fft
from ..parallel.fft import export_wisdom, import_wisdom, pyfftw
from ..parallel.slab import Slab
from . import files
from .recorder import processor


def gather(slab: Slab) -> NDArray[np.uint8]:
    """Return the FFTW wisdom of all ranks, for a checkpoint. Collective."""
    everyone = [wisdom.decode("latin-1") for wisdom in slab.from_all(export_wisdom())]
    different = list(dict.fromkeys(everyone))
    text = json.dumps({"plans": different, "of": [different.index(wisdom) for wisdom in everyone]})
    return np.frombuffer(zlib.compress(text.encode()), dtype=np.uint8)


def recall(transforms: Sequence[Any], slab: Slab, saved: NDArray[np.uint8] | None) -> None:
    """Use the wisdom `saved` in a checkpoint if it was written by as many ranks as this run has. Otherwise use the
    wisdom that this machine stored in its first run with the same `transforms` (`march.choices.Choices`).
    Collective."""

    def kept() -> bytes:
        with suppress(OSError):
            if place := _place(transforms, slab):
                return place.read_bytes()
        return b""

    if saved is None or not _adopt(saved.tobytes(), slab):
        _adopt(slab.agree(kept() if slab.root else b""), slab)


def keep(transforms: Sequence[Any], slab: Slab) -> None:
    """Store the wisdom of this run for later runs. Collective. A stored wisdom that is at least as large has at least
    as many transforms, and is kept."""
    data = gather(slab).tobytes()
    with suppress(OSError):  # a run without stored wisdom works too
        place = _place(transforms, slab) if slab.root else None
        if place and not (place.exists() and place.stat().st_size >= len(data)):
            with files.replaced(place) as file:
                file.write(data)


def _adopt(data: bytes, slab: Slab) -> bool:
    try:
        kept = json.loads(zlib.decompress(data))
        ranks, plans = kept["of"], kept["plans"]
        return len(ranks) == slab.comm.size and import_wisdom(plans[ranks[slab.comm.rank]].encode("latin-1"))
    except (zlib.error, ValueError, KeyError, IndexError, TypeError):
        return False


def _place(transforms: Sequence[Any], slab: Slab) -> Path | None:
    """Return the file of wisdom for this kind of machine and these transforms, None without a safe directory."""
    directory = compiled.directory("plans")
    made_by = b"".join(Path(path).read_bytes() for path in (fft.__file__,))
    facts = [platform.machine(), processor(), pyfftw.fftw_version, zlib.crc32(made_by)]
    facts += [slab.comm.size, *transforms]
    name = hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:16]
    return directory / name if directory else None
