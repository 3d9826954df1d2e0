"""A random surface in a box is one sample: by how much another one, with another seed, would differ."""

import math

from ..model import Job
from ..sections.geometry import Rough

# Standard deviations over 8 to 12 seeds, times the longest waves along a side; found with six steady states of 2 to
# 50 % contact of bodies of one and twelve branches, in boxes of 2, 4 and 8 of these waves: 0.11 to 0.44 for friction,
# 0.05 to 0.33 for the area.
FRICTION, AREA = 0.24, 0.17


def describe_sample(job: Job, slides: bool) -> str:
    """Return by how much friction, if it `slides`, and the contact area of another seed differ; '' without a seed.

    As many independent parts as long waves fit into the box average out by the root of their number.
    """
    longest = max((shape.long_wavelength for shape in job.surface if isinstance(shape, Rough)), default=0.0)
    if not longest:
        return ""
    sides = [length for length, points in zip(job.grid.size, job.grid.points, strict=True) if points > 1]
    counts = [max(length / longest, 1.0) for length in sides]
    root = math.sqrt(math.prod(counts))
    friction = f"friction by about {FRICTION / root:.1%} and " if slides else ""
    return (
        f"another seed of the surface would change {friction}the contact area by about {AREA / root:.1%} (standard "
        f"deviation): {' x '.join(f'{count:.3g}' for count in counts)} of its longest waves fit into the box"
    )
