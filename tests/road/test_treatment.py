"""What is done to a map, against maps whose truth is known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.job import measured_maps

from . import truth

LENGTH = 1e-3
ROAD = truth.rough(256, 2 * LENGTH, 5e-4, 5e-5, 0.1)[:128, :128]  # a cut: no periodic edges
X, Y = np.meshgrid(np.linspace(-1.0, 1.0, 128), np.linspace(-1.0, 1.0, 128))


@pytest.mark.parametrize(
    ("detrend", "trend"),
    [("mean", [3e-6]), ("tilt", [3e-6, 2e-5, -1e-5]), ("curvature", [3e-6, 2e-5, -1e-5, 4e-6, 5e-6, -6e-6])],
)
def test_a_trend_is_found_and_taken_off(detrend: str, trend: list[float]) -> None:
    """Exactly, where nothing else is there and a tenth of the points is missing."""
    terms = [np.ones_like(X), X, Y, X * X, X * Y, Y * Y]
    heights = np.sum([c * term for c, term in zip(trend, terms, strict=False)], axis=0)
    heights[np.random.default_rng(1).random(X.shape) < 0.1] = np.nan
    done = measured_maps.treat(heights, detrend, "none")
    assert np.abs(done.heights).max() < 1e-17
    assert done.missing == np.isnan(heights).sum()


def test_holes_are_filled_smoothly() -> None:
    """A harmonic surface is filled as it is (to what a relaxation leaves, 1e-3 of its height): no kinks, no steps."""
    heights = X**2 - Y**2
    known = np.random.default_rng(2).random(X.shape) >= 0.02
    known[60:66, 40:46] = False
    filled = measured_maps.fill(np.where(known, heights, np.nan), known)
    assert np.array_equal(filled[known], heights[known])
    assert np.abs(filled - heights)[1:-1, 1:-1].max() < 1e-3
    assert np.abs(filled - heights).max() < 0.02  # at the edges of the map half of the neighbours are missing


def test_the_periodic_part_keeps_slopes() -> None:
    """No jump across the edges larger than between neighbours inside; the slope inside stays within 1 %."""
    tilted = ROAD + 1e-5 * X
    made = measured_maps.make_periodic(tilted)
    inside = np.abs(np.diff(ROAD, axis=1)).max()
    assert np.abs(made[:, 0] - made[:, -1]).max() < inside
    assert np.abs(made[0] - made[-1]).max() < inside
    whole = truth.rms_slope(np.asarray(measured_maps.treat(tilted, "tilt", "smooth").heights), LENGTH)
    assert whole == pytest.approx(truth.central_slope(ROAD, LENGTH, 4), rel=0.03)


def test_a_periodic_map_is_left_alone() -> None:
    """What jumps nowhere has no smooth part, but for one difference across the edge."""
    periodic = truth.rough(128, LENGTH, 5e-4, 1.25e-4, 0.1)
    assert_allclose(measured_maps.make_periodic(periodic), periodic, atol=0.03 * np.ptp(periodic))


def test_mirrors_keep_everything() -> None:
    mirrored = measured_maps.treat(ROAD, "none", "mirror").heights
    assert mirrored.shape == (256, 256)
    assert np.array_equal(mirrored[:128, :128], ROAD)
    assert np.array_equal(mirrored[128:, :128], ROAD[::-1])
    assert np.array_equal(mirrored[0], mirrored[-1])
    assert np.std(mirrored) == pytest.approx(np.std(ROAD), rel=1e-12)


@pytest.mark.parametrize("shape", [(64, 64), (97, 64), (300, 301), (64, 300)])
def test_resampling_by_fourier_series(shape: tuple[int, int]) -> None:
    """Waves that both grids have are exact on either; those that the new grid has not are left out."""

    def waves(shape: tuple[int, int], *numbers: tuple[int, int]) -> np.ndarray:
        y, x = (2 * np.pi * np.arange(n) / n for n in shape)
        return np.sum([np.cos(a * x + b * y[:, None] + a + 0.3) for a, b in numbers], axis=0)

    old = (128, 100)
    kept, lost = [(3, 4), (0, 31), (31, -5)], [(45, 60)]
    found = measured_maps.resample(waves(old, *kept, *lost), shape)
    fits = all(abs(n) < size / 2 for n, size in zip(lost[0], shape[::-1], strict=True))
    assert_allclose(found, waves(shape, *kept, *(lost if fits else [])), atol=1e-12)


@pytest.mark.parametrize("shape", [(128, 128), (60, 64), (150, 128)])
def test_an_ideal_low_pass(shape: tuple[int, int]) -> None:
    """Waves within the ellipse stay exactly, also those on it; others are gone, on any grid."""

    def waves(shape: tuple[int, int], *numbers: tuple[int, int]) -> np.ndarray:
        y, x = (2 * np.pi * np.arange(n) / n for n in shape)
        return np.sum([np.cos(a * x + b * y[:, None] + a + 0.3) for a, b in numbers], axis=0)

    kept, lost = [(3, 4), (0, 20), (10, 0), (6, -16)], [(0, 21), (11, 0), (9, 12)]
    found = measured_maps.resample(waves((128, 128), *kept, *lost), shape, most=(20.0 * (1 + 1e-9), 10.0 * (1 + 1e-9)))
    assert_allclose(found, waves(shape, *kept), atol=1e-12)


def test_a_low_pass_of_a_map_with_open_edges() -> None:
    """A slope keeps its height, as its harmonic part is not filtered; a short wave on it is gone inside."""
    slope = np.tile(np.linspace(0.0, 1.0, 128, endpoint=False), (128, 1))
    wave = 0.1 * np.cos(2 * np.pi * 32 * np.arange(128) / 128)
    found = measured_maps.resample(slope + wave[:, None], (128, 128), joined=False, most=(16.0, 16.0))
    assert np.abs(found - slope)[8:-8, 8:-8].max() < 0.02


def test_resampling_without_periodic_edges() -> None:
    """A slope stays one up to the edges: to 2 % of its height, where a Fourier series alone would swing by 10 %."""
    slope = np.tile(np.linspace(0.0, 1.0, 100, endpoint=False), (100, 1))
    found = measured_maps.resample(slope, (250, 250), joined=False)
    expected = np.tile(np.minimum(np.linspace(0.0, 1.0, 250, endpoint=False), 0.99), (250, 1))
    assert np.abs(found - expected).max() < 0.02


def test_outliers_are_found() -> None:
    spiked = ROAD.copy()
    spiked[10, 20] += 50e-6
    spiked[90, 3] -= 50e-6
    spiked[0, 0] += 50e-6
    assert not measured_maps.find_outliers(ROAD)[0].any()
    assert np.argwhere(measured_maps.find_outliers(spiked)[0]).tolist() == [[0, 0], [10, 20], [90, 3]]


def test_outliers_are_clipped() -> None:
    """They get the median of their neighbours, and the plane is that without them; other points stay."""
    spiked = ROAD.copy()
    spiked[10, 20] += 5e-3
    done = measured_maps.treat(spiked, "tilt", "none", clip=True)
    plain = measured_maps.treat(ROAD, "tilt", "none").heights
    rest = np.ones(ROAD.shape, dtype=bool)
    rest[10, 20] = False
    step = np.abs(np.diff(ROAD, axis=0)).max()
    assert np.argwhere(done.outliers).tolist() == [[10, 20]]
    assert abs(done.heights[10, 20] - plain[10, 20]) < step
    assert np.abs(done.heights - plain)[rest].max() < 1e-3 * step  # one point of 16384 has moved by less than a step
