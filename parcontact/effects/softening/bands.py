"""Strains and factors of bands in full contact, from the spectrum alone."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from .strain_table import strains_in_full_contact

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
    strains = strains_in_full_contact(q, slopes, np.arange(q.size) // BINS, cut.count)
    f, g = section.made.factors(strains)
    each = (f"{strain:.2g} (f {a:.2g}, g {b:.2g})" for strain, a, b in zip(strains, f, g, strict=True))
    yield f"softening: strains of the bands in full contact {', '.join(each)}"
