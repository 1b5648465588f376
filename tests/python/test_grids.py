"""Default grids and the checks on them."""

import numpy as np
import pytest

from reference.histories import WAVELENGTH, history
from sarfocus import ImageGrid, MemoryEstimateError
from sarfocus.grids import axes, check_grid, default_grid, resolution
from sarfocus.io import PhaseHistory
from sarfocus.memory import require_image_memory


def test_default_grid_is_centred_and_axes_follow_the_track():
    grid = default_grid(history())
    rows, columns = grid.shape
    np.testing.assert_allclose(grid.position((rows - 1) / 2, (columns - 1) / 2), (0, 0, 0), atol=1e-9)
    _, azimuth_step, range_step = np.asarray(grid.vectors)
    np.testing.assert_allclose(azimuth_step / np.linalg.norm(azimuth_step), (0, 1, 0), atol=1e-9)
    np.testing.assert_allclose(range_step / np.linalg.norm(range_step), (1, 0, 0), atol=1e-9)
    assert rows * np.linalg.norm(azimuth_step) == pytest.approx(20.0, rel=0.02)


def test_azimuth_follows_the_sense_of_flight():
    base = history()
    back = PhaseHistory(base.data, base.positions[::-1], base.range_start, base.range_spacing, base.wavelength, base.metadata)
    np.testing.assert_allclose(axes(back.positions, np.zeros(3))[0], (0, -1, 0), atol=1e-9)


def test_resolution_is_that_of_the_aperture():
    cell = resolution(history(), np.zeros(3))
    # 40 m of track seen from 1118 m; the angle stands for its sine to 1e-4.
    assert cell[0] == pytest.approx(WAVELENGTH * np.hypot(1000, 500) / (2 * 40), rel=1e-3)
    assert cell[1] == pytest.approx(1.25 * 0.5 * np.hypot(1000, 500) / 1000, rel=1e-3)


def test_bistatic_grids_use_the_midpoints():
    base = history()
    offset = np.array([0.0, 0.0, 30.0])
    pair = (base.positions + offset, base.positions - offset)
    bistatic = PhaseHistory(base.data, pair, base.range_start, base.range_spacing, base.wavelength, base.metadata)
    np.testing.assert_allclose(default_grid(bistatic).vectors, default_grid(base).vectors, atol=1e-12)


def test_without_metadata_the_centre_must_be_given():
    base = history()
    bare = PhaseHistory(base.data, base.positions, base.range_start, base.range_spacing, base.wavelength)
    with pytest.raises(ValueError, match="centre"):
        default_grid(bare)
    grid = default_grid(bare, centre=(0.0, 0.0, 0.0))
    assert min(grid.shape) > 1
    check_grid(bare, grid)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"size": (0.0, 5.0)}, "size"),
        ({"size": (5.0,)}, "size"),
        ({"spacing": (-1.0, 1.0)}, "spacing"),
        ({"spacing": (np.nan, 1.0)}, "spacing"),
        ({"centre": (0.0, np.inf, 0.0)}, "centre"),
        ({"centre": (0.0, 0.0)}, "centre"),
        ({"size": (1e13, 1.0), "spacing": (0.1, 0.1)}, "pixels"),
    ],
)
def test_bad_options(options, says):
    with pytest.raises(ValueError, match=says):
        default_grid(history(), **options)


def test_radar_that_stands_still():
    base = history()
    still = np.repeat(base.positions[:1], len(base.data), axis=0)
    with pytest.raises(ValueError, match="moves"):
        default_grid(PhaseHistory(base.data, still, base.range_start, base.range_spacing, base.wavelength, base.metadata))


def test_no_trajectory():
    base = history()
    with pytest.raises(ValueError, match="trajectory"):
        default_grid(PhaseHistory(base.data, None, base.range_start, base.range_spacing, base.wavelength, base.metadata))


def test_grid_behind_the_radar():
    with pytest.raises(ValueError, match="behind"):
        check_grid(history(), ImageGrid.plane((-1600.0, -5.0, 0.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), (20, 20)))
    with pytest.raises(ValueError, match="behind"):
        check_grid(history(), ImageGrid.plane((-1600.0, -5.0, 0.0), (0.0, 0.5, 0.0), (50.0, 0.0, 0.0), (20, 40)))


def test_memory_estimate_says_how_much():
    with pytest.raises(MemoryEstimateError, match=r"1000000 x 1000000 pixels need 7450\.6 GiB"):
        require_image_memory((1_000_000, 1_000_000))
    require_image_memory((100, 100))
