"""Warning where linear theory fails: the surface is too steep."""

import math
from collections.abc import Iterator

from ..doubts import Doubt
from .wave_spectrum import WaveSpectrum

STEEP = 0.5  # physics: rms slope, up to which slopes count as small
USUAL = 1.3  # physics: rms slope at which the literature on rubber friction cuts spectra off (Lorenz et al. 2011)
ROUNDED = 1.01  # rounding: rms slope over USUAL, up to which a spectrum has been cut off there
STRAIN = math.exp(-1.0)  # physics: rms strain over rms slope, at the depth 1/q where the strain of a wave is largest


def doubt_steep_waves(spectrum: WaveSpectrum) -> Iterator[Doubt]:
    """Yield a warning if the surface is too steep for linear theory, with the usual cut-off."""
    slope = math.sqrt(spectrum.moment(*spectrum.ends, 2))
    if slope <= STEEP:
        return
    steep, usual = spectrum.steep_beyond(STEEP), spectrum.steep_beyond(USUAL)
    numbers = {"slope": slope, "strain": STRAIN * slope, "steep": steep, "most": STEEP}
    if usual and slope > ROUNDED * USUAL:
        yield Doubt("steep waves, cut-off", "surface", {**numbers, "usual": usual, "cutoff": USUAL})
    else:
        yield Doubt("steep waves", "surface", numbers)
