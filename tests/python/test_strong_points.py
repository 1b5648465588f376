"""The motion from many points in clutter: regions round them, hrws.si_mec(pixels="brightest"), echoes of extended scenes."""

from typing import Any

import numpy as np
import pytest

import sarfocus
from sarfocus import ImageGrid, hrws, simulate

WAVELENGTH, PRF, VELOCITY, HEIGHT = 0.031, 60.0, 40.0, 2000.0
DOPPLER, BANDWIDTH, SPACING = 100.0, 250e6, 0.5
N_PULSE = 260  # 173 m; a beam is 142 m wide at 3.6 km
ALONG, GROUND = 48.0, (3000.0, 3200.0)
SHAPE = (120, 200)
TRACK = np.stack([VELOCITY / PRF * (np.arange(N_PULSE) - 0.5 * (N_PULSE - 1)), np.zeros(N_PULSE), np.full(N_PULSE, HEIGHT)], axis=1)
CHANNELS = np.array([[0.35 * n, 0.0, 0.0] for n in range(3)])
BAND: dict[str, Any] = {"doppler_bandwidth": DOPPLER}
GRID = ImageGrid.plane((-0.5 * ALONG, GROUND[0], 0.0), (ALONG / SHAPE[0], 0.0, 0.0), (0.0, 1.0, 0.0), SHAPE)
RADAR: dict[str, Any] = {
    "n_range": 700,
    "range_start": 3530.0,
    "range_spacing": SPACING,
    "wavelength": WAVELENGTH,
    "bandwidth": BANDWIDTH,
    "prf": PRF,
}


def heights(size: float = 0.6) -> np.ndarray:
    """White, uniform over `size` wavelengths: 0.6 turn the phase by up to 2.1 rad either way, of which sin(x) / x leaves 42 %."""
    motion = np.zeros((N_PULSE, 3))
    motion[:, 2] = size * WAVELENGTH * np.random.default_rng(3).uniform(-0.5, 0.5, N_PULSE)
    return motion


def scene(points: int, seed: int = 5) -> np.ndarray:
    """Clutter of unit power, points 26 dB over it."""
    generator = np.random.default_rng(seed)
    made = (generator.standard_normal(SHAPE) + 1j * generator.standard_normal(SHAPE)) / np.sqrt(2.0)
    where = generator.choice(made.size, points, replace=False)
    made.reshape(-1)[where] += 20.0 * np.exp(2j * np.pi * generator.random(points))
    return made.astype(np.complex64)


def echo_of(pixels: np.ndarray, motion: np.ndarray) -> hrws.Echo:
    return simulate.hrws_scene(TRACK, CHANNELS, pixels, GRID, motion=motion, **BAND, **RADAR)


@pytest.fixture(scope="module")
def blurred() -> hrws.Echo:
    return echo_of(scene(60), heights())


@pytest.fixture(scope="module")
def image(blurred):
    return hrws.reconstruct(blurred, GRID, **BAND)


@pytest.fixture(scope="module")
def regions(image):
    return hrws.strong_regions(image, GRID, 60, sections=6)


@pytest.mark.parametrize("at", [(17, 40), (60, 100), (101, 163)])
def test_the_echo_of_a_scene_is_that_of_its_points(at):
    pixels = np.zeros(SHAPE, np.complex64)
    pixels[at] = 1.0
    motion = heights()
    made = echo_of(pixels, motion)
    points = simulate.hrws(TRACK, CHANNELS, [GRID.position(*at)], [1.0], motion=motion, **BAND, **RADAR)
    lit = [np.abs(echo.data).max(axis=2) > 1e-3 for echo in (made, points)]
    assert np.sum(lit[0] != lit[1]) <= 2  # pulses within rounding of an end of the beam
    same = np.stack([echo.data[lit[0] & lit[1]] for echo in (made, points)])
    gain = np.vdot(same[1], same[0]) / np.vdot(same[1], same[1])  # of the sampling over the bandwidth
    # Tails of the pulse that the record cuts off, of 1 / (200 pi) either side; 0.9 % measured.
    error = np.linalg.norm(same[0] - gain * same[1]) / np.linalg.norm(same[0])
    assert error < 2e-2
    assert abs(np.angle(gain)) < 1e-3
    np.testing.assert_array_equal(made.phase_centres, points.phase_centres)
    np.testing.assert_array_equal(made.baselines, points.baselines)


def test_many_points_in_clutter_tell_the_height(blurred, regions):
    found = hrws.si_mec(blurred, GRID, regions, pixels="brightest", **BAND)
    assert found.status is hrws.SiMecStatus.converged, found.summary()
    truth = heights()
    none, true = (sarfocus.quality.entropy(hrws.reconstruct(blurred, GRID, motion, **BAND)) for motion in (None, truth))
    assert abs(sarfocus.quality.entropy(found.image) - true) < 0.02 * (none - true)  # 1 % measured
    left = (found.motion - truth)[:, 2]
    left -= np.polynomial.Polynomial.fit(np.arange(N_PULSE), left, 1)(np.arange(N_PULSE))
    # Twice what the scatter of the terms says: slow displacements of half an aperture and more are told less well.
    assert left.std() < 2.0 * np.sqrt(np.mean(found.motion_std[:, 2] ** 2))
    assert (np.diff(found.objective) > -1e-9).all()
    assert found.regions["held_out"].mean() > 0.8 * found.coherence


def test_the_same_bits_for_any_number_of_threads(blurred, regions):
    one = hrws.si_mec(blurred, GRID, regions, pixels="brightest", threads=1, **BAND)
    two = hrws.si_mec(blurred, GRID, regions, pixels="brightest", threads=2, **BAND)
    np.testing.assert_array_equal(one.motion, two.motion)
    np.testing.assert_array_equal(one.image, two.image)


@pytest.mark.parametrize(("points", "size"), [(0, 0.6), (0, 0.0), (60, 0.0)])
def test_without_error_or_points_nothing_is_moved(points, size):
    echo = echo_of(scene(points), heights(size))
    regions = hrws.strong_regions(hrws.reconstruct(echo, GRID, **BAND), GRID, 60, sections=6)
    found = hrws.si_mec(echo, GRID, regions, pixels="brightest", **BAND)
    assert not found.motion.any(), found.reason
    assert found.status in (hrws.SiMecStatus.not_improved, hrws.SiMecStatus.no_strong_point)


def test_regions_cover_every_section_and_their_points(image):
    regions = hrws.strong_regions(image, GRID, 24, sections=4)
    assert len(regions) == 24
    along = np.array([region.position(2, 2)[0] for region in regions])
    assert (np.histogram(along, np.linspace(-24.2, 23.8, 5))[0] == 6).all()
    assert all(region.shape == (5, 5) for region in regions)


def test_bad_arguments_are_refused(image, blurred, regions):
    with pytest.raises(ValueError, match="sections"):
        hrws.strong_regions(image, GRID, 10, sections=0)
    with pytest.raises(ValueError, match="shape"):
        hrws.strong_regions(image[1:], GRID, 10)
    with pytest.raises(ValueError, match="plane"):
        hrws.strong_regions(image[:1, :1], ImageGrid.from_points(np.zeros((1, 1, 3))), 10)
    with pytest.raises(ValueError, match="pixels"):
        hrws.si_mec(blurred, GRID, regions, pixels="all", **BAND)
    with pytest.raises(ValueError, match="knots"):
        hrws.si_mec(blurred, GRID, regions, pixels="brightest", knots=8, **BAND)


def test_can_be_stopped(blurred, regions):
    with pytest.raises(sarfocus.Cancelled):
        hrws.si_mec(blurred, GRID, regions, pixels="brightest", progress=lambda *_: False, **BAND)
