"""Signed distance grids."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion

from a2v.geometry.volume import _spread


@pytest.mark.parametrize("reach", [1, 3])
def test_spreading_along_the_axes_is_dilation_with_a_cube(reach: int) -> None:
    inside = np.random.default_rng(0).random((17, 9, 2)) < 0.1
    block = np.ones((3, 3, 3), bool)
    assert (_spread(inside, reach) == binary_dilation(inside, block, iterations=reach)).all()
    inside = np.ones((17, 12, 9), bool)
    inside[14, 2, 4] = inside[0, 11, 8] = False
    eroded = binary_erosion(inside, block, iterations=reach)
    assert (_spread(~inside, reach, border=True) == ~eroded).all()
    assert eroded.any()
