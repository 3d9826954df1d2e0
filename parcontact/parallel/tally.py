"""Counts of what a run has done and allocated; counts do not depend on how busy the machine is."""

from collections import Counter


class Tally(Counter[str]):
    """Named counts of one rank, e.g. `tally["operator"]`; a name never counted reads 0.

    Names in use: `fft` (2-D transforms, forward or backward), `fft 2048x2048 float64` (the same by size and precision),
    `operator` (applications of a pressure -> displacement operator or its inverse), `allreduce`, `bytes sent` (to other
    ranks), `map bytes` (allocated for maps and transform buffers), `shift` (sub-cell shifts of a surface), `retry`.
    """

    def since(self, earlier: Counter[str]) -> dict[str, int]:
        """What was counted after `earlier = tally.copy()`."""
        return {name: count - earlier[name] for name, count in self.items() if count != earlier[name]}
