"""Where linear theory fails: rms slopes and strains of bands, alone and with all coarser ones."""

import math

from .wave_spectrum import WaveSpectrum

STEEP = 0.5  # physics: rms slope, up to which slopes count as small
USUAL = 1.3  # physics: rms slope at which the literature on rubber friction cuts spectra off (Lorenz et al. 2011)
STRAIN = math.exp(-1.0)  # physics: rms strain over rms slope, at the depth 1/q where the strain of a wave is largest


def describe_slopes(spectrum: WaveSpectrum) -> list[str]:
    """Return a sentence where the surface is too steep for linear theory, with the cut-off that is usual."""
    slope = math.sqrt(spectrum.moment(*spectrum.ends, 2))
    if slope <= STEEP:
        return []
    steep, usual = spectrum.steep_beyond(STEEP), spectrum.steep_beyond(USUAL)
    offer = f"; waves shorter than {usual:.3g} m are usually left out: bands.cutoff_slope: {USUAL:g}" if usual else ""
    return [
        f"surface: its rms slope is {slope:.3g} (rms strain {STRAIN * slope:.2g}), and linear theory has small slopes: "
        f"waves shorter than {steep:.3g} m go beyond a slope of {STEEP:g}{offer}"
    ]
