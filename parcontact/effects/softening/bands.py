"""Strains and factors of bands in full contact, from the spectrum alone.

With r = k_j/q it is `gamma_q^2 = sum_j 12 (k_j A_j)^2 r^2/(1 + r)^5`; `(k A)^2` is twice the mean square slope of a
wave.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

BINS = 12  # accuracy: bins of wavenumbers in a band


def describe_bands(job: Any, cut: Any) -> Iterator[str]:
    """Yield a sentence with the strain and the factors f and g of each band of a job (`bands.choice.Cut`)."""
    section = job.section("softening")
    if section is None:
        return
    edges = np.concatenate(
        [np.geomspace(cut.edges[k], cut.edges[k + 1], BINS + 1)[int(k > 0) :] for k in range(cut.count)]
    )
    q = np.sqrt(edges[1:] * edges[:-1])
    slopes = np.array([cut.spectrum.moment(float(a), float(b), 2) for a, b in pairwise(edges)])
    ratio = q / q[:, None]
    squares = (24.0 * slopes * ratio**2 / (1.0 + ratio) ** 5).sum(axis=1)
    parts = zip(np.split(squares, cut.count), np.split(slopes, cut.count), strict=True)
    strains = np.sqrt([np.average(square, weights=weight) for square, weight in parts])
    f, g = section.made.factors(strains)
    each = (f"{strain:.2g} (f {a:.2g}, g {b:.2g})" for strain, a, b in zip(strains, f, g, strict=True))
    yield f"softening: strains of the bands in full contact {', '.join(each)}"
