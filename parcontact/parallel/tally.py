"""Counts of what a run has done and allocated; counts do not depend on how busy the machine is."""

import weakref
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Tally(Counter[str]):
    """Named counts of one rank, e.g. `tally["operator"]`; a name never counted reads 0.

    Names in use: `fft` (2-D transforms, forward or backward), `fft 2048x2048 float64` (the same by size and precision),
    `operator` (applications of a pressure -> displacement operator or its inverse), `allreduce`, `bytes sent` (to other
    ranks in transforms and moves of rows), `map bytes` (held in maps and transform buffers), `map bytes at most` (the
    most of them at once), `shift` (sub-cell shifts of a surface).
    """

    def hold(self, array: NDArray[Any]) -> None:
        """Count the bytes of an array, until it is gone."""
        self["map bytes"] += array.nbytes
        self["map bytes at most"] = max(self["map bytes at most"], self["map bytes"])
        owner = array
        while isinstance(owner.base, np.ndarray):  # views of it live on with it
            owner = owner.base
        weakref.finalize(owner, self.subtract, {"map bytes": array.nbytes}).atexit = False

    def since(self, earlier: Counter[str]) -> dict[str, int]:
        """Return the counts since `earlier = tally.copy()`."""
        return {name: count - earlier[name] for name, count in self.items() if count != earlier[name]}
