"""Counts of what a run has done and allocated; counts do not depend on how busy the machine is."""

import weakref
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

PURPOSE = "map bytes: "  # before the purpose of arrays in the names of a ledger's counts


class Tally(Counter[str]):
    """Named counts of one rank, e.g. `tally["operator"]`; a name never counted reads 0.

    Names in use: `fft` (2-D transforms, forward or backward), `fft 2048x2048 float64` (the same by size and precision),
    `operator` (applications of a pressure -> displacement operator or its inverse), `allreduce`, `bytes sent` (to other
    ranks in transforms and moves of rows), `map bytes` (held in maps and transform buffers), `map bytes at most` (the
    most of them at once), `shift` (sub-cell shifts of a surface).

    Where it `only_counts`, arrays take no memory (`Ledger`). The `purpose` of arrays is noted by a ledger alone.
    """

    only_counts = False
    purpose = ""

    def hold(self, array: NDArray[Any]) -> None:
        """Count the bytes of an array, until it is gone."""
        self["map bytes"] += array.nbytes
        self["map bytes at most"] = max(self["map bytes at most"], self["map bytes"])
        owner = array
        while isinstance(owner.base, np.ndarray):  # views of it live on with it
            owner = owner.base
        weakref.finalize(owner, self.subtract, {"map bytes": array.nbytes}).atexit = False

    @property
    def by_purpose(self) -> dict[str, int]:
        """Return the bytes of all arrays of a ledger by their purposes."""
        return {name.removeprefix(PURPOSE): held for name, held in self.items() if name.startswith(PURPOSE) and held}

    def since(self, earlier: Counter[str]) -> dict[str, int]:
        """Return the counts since `earlier = tally.copy()`."""
        return {name: count - earlier[name] for name, count in self.items() if count != earlier[name]}


class Ledger(Tally):
    """Counts of a calculation that is planned and never made.

    Its arrays have their shapes and types, but take no memory and have no values: nothing is calculated with them.
    Their bytes are counted under their purposes, too.
    """

    only_counts = True

    def hold(self, array: NDArray[Any]) -> None:
        """Count the bytes of an array, until it is gone, also under its purpose."""
        super().hold(array)
        name = f"{PURPOSE}{self.purpose}"
        self[name] += array.nbytes
        weakref.finalize(array.base, self.subtract, {name: array.nbytes}).atexit = False
