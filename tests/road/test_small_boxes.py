"""A box as large as a point of the map, or smaller, is refused instead of being flat."""

from pathlib import Path

import numpy as np
import pytest

import parcontact as pc

APART = 1e-5  # m, from one point of the map to the next


@pytest.fixture
def road(tmp_path: Path) -> dict[str, object]:
    np.save(tmp_path / "road.npy", np.random.default_rng(1).standard_normal((16, 16)))
    size = [16 * APART, 16 * APART]
    return {"shape": "topography", "path": str(tmp_path / "road.npy"), "unit": "um", "size": size}


@pytest.mark.parametrize("periodic", ["smooth", "window", "mirror"])
@pytest.mark.parametrize("size", [0.01 * APART, 0.9 * APART, [10 * APART, 1.4 * APART]])
def test_a_box_of_one_point(road: dict[str, object], size: object, periodic: str) -> None:
    with pytest.raises(pc.InputError, match=r"the box is .* m along \w, and points of the map are 1e-05 m apart"):
        pc.surface({**road, "periodic": periodic}, {"points": 8, "size": size})


def test_a_profile_is_one_point_wide(road: dict[str, object]) -> None:
    heights = pc.surface(road, {"points": [8, 1], "size": [8 * APART, APART]})
    assert heights.shape == (1, 8)
    assert np.ptp(heights) > 0.0
