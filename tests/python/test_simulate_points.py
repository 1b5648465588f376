"""simulate.points and simulate.points_frequency against the equations, and through the image formation to the pixel."""

import numpy as np
import pytest
import scipy.signal
from numpy.typing import NDArray

import sarfocus
from reference import compression, echoes
from sarfocus import simulate

C = echoes.C
NOISE = 1  # number of the noise stream


def path(n_pulse: int, seed: int = 0) -> NDArray[np.float64]:
    """A wavering track, 7 km from the scene."""
    rng = np.random.default_rng(seed)
    along = np.linspace(-80, 80, n_pulse)
    return np.stack([along, np.full(n_pulse, -6000.0), np.full(n_pulse, 3600.0)], axis=1) + 0.3 * rng.normal(size=(n_pulse, 3)).cumsum(
        axis=0
    )


def scene(n: int, seed: int = 1) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-30, 30, size=(n, 3)), rng.normal(size=n) + 1j * rng.normal(size=n)


@pytest.mark.parametrize("bistatic", [False, True])
def test_echoes_are_the_sum_of_delayed_pulses(bistatic: bool) -> None:
    tx, rx = path(9), path(9, seed=4) + np.array([200.0, 50.0, -300.0])
    targets, reflectivity = scene(6)
    start = 6950.0 + np.arange(9)
    data = simulate.points(
        (tx, rx) if bistatic else tx,
        targets,
        reflectivity,
        n_range=200,
        range_start=start,
        range_spacing=0.5,
        wavelength=0.031,
        bandwidth=290e6,
    )
    distance = echoes.ranges(tx, rx if bistatic else tx, targets)
    expected = echoes.point_echoes(distance, reflectivity, start[:, None] + 0.5 * np.arange(200), 0.031, 290e6)
    assert np.abs(data - expected).max() < 1e-6  # rounding to single precision of values below 5, the largest 3e-7


@pytest.mark.parametrize("window", ["hann", ("taylor", 4, 35.0), ("kaiser", 5.0)])
def test_windowed_pulse_is_the_transform_of_the_window(window: str | tuple[str | float, ...]) -> None:
    tx, targets = path(2), np.zeros((1, 3))
    data = simulate.points(
        tx, targets, [1.0], n_range=100, range_start=6980.0, range_spacing=0.4, wavelength=0.031, bandwidth=300e6, window=window
    )
    distance = echoes.ranges(tx, tx, targets)[:, 0]
    x = 2 * 300e6 / C * (6980.0 + 0.4 * np.arange(100) - distance[:, None])
    n = 20001
    samples = scipy.signal.get_window(window, n, fftbins=False)
    nu = (np.arange(n) - (n - 1) / 2) / (n if window[0] == "taylor" else n - 1)
    expected = echoes.response(samples, nu, x) * np.exp(-4j * np.pi * distance[:, None] / 0.031)
    assert np.abs(data - expected).max() < 2e-6  # the trapezium rule, (pi x / n)^2 / 6 with x to 45, and single precision


def test_noise_is_the_published_generator() -> None:
    seed = 0x1234_5678_9ABC_DEF0
    data = simulate.points(
        path(4),
        [[0, 0, 0]],
        [0],
        n_range=1000,
        range_start=0.0,
        range_spacing=0.4,
        wavelength=0.03,
        bandwidth=1e8,
        noise_power=9.0,
        seed=seed,
    )
    expected = (3 * echoes.complex_normal(seed, NOISE, 4000)).astype(np.complex64).reshape(4, 1000)
    # np.log may differ in its last bit from the library's: one step of single precision at most.
    assert np.abs(data - expected).max() <= np.spacing(np.float32(16))


def test_noise_bits_are_fixed() -> None:
    """Regression: these bits on every platform and number of threads."""
    data = simulate.points(
        path(2),
        [[0, 0, 0]],
        [0],
        n_range=2,
        range_start=0.0,
        range_spacing=0.4,
        wavelength=0.03,
        bandwidth=1e8,
        noise_power=1.0,
        seed=42,
        threads=2,
    )
    expected = echoes.complex_normal(42, NOISE, 4).astype(np.complex64).reshape(2, 2)
    assert data.tobytes() == expected.tobytes()


@pytest.mark.parametrize("bistatic", [False, True])
def test_phase_history_keeps_its_stated_error(bistatic: bool) -> None:
    tx, rx = path(5), path(5, seed=4) + np.array([200.0, 50.0, -300.0])
    targets, reflectivity = scene(1000)
    reference_range = np.linalg.norm(tx, axis=1)
    data = simulate.points_frequency(
        (tx, rx) if bistatic else tx,
        targets,
        reflectivity,
        n_frequency=123,
        frequency_start=9.3e9,
        frequency_spacing=1.2e6,
        reference_range=reference_range,
    )
    frequency = 9.3e9 + 1.2e6 * np.arange(123)
    expected = compression.phase_history(frequency, reference_range, echoes.ranges(tx, rx if bistatic else tx, targets), reflectivity)
    assert np.linalg.norm(data - expected) < 5e-7 * np.linalg.norm(expected)  # stated in the header


def test_both_simulators_agree_through_compression() -> None:
    """Frequency-domain data compressed equal range-compressed echoes of the same band but for the periodic continuation of the pulse."""
    positions = path(7)
    targets, reflectivity = scene(5)
    n, spacing = 400, 0.75e6
    reference_range = np.linalg.norm(positions, axis=1)
    history = simulate.points_frequency(
        positions, targets, reflectivity, n_frequency=n, frequency_start=9.3e9, frequency_spacing=spacing, reference_range=reference_range
    )
    result = sarfocus.compress_frequency(
        history, frequency_start=9.3e9, frequency_spacing=spacing, reference_range=reference_range, window="hann"
    )
    # The symmetric Hann window of n samples has its zeros at the ends: a band of n - 1 spacings.
    direct = simulate.points(
        positions,
        targets,
        reflectivity,
        n_range=result.data.shape[1],
        range_start=result.range_start,
        range_spacing=result.range_spacing,
        wavelength=result.wavelength,
        bandwidth=(n - 1) * spacing,
        window="hann",
    )
    # Hann sidelobes fall as x^-3: at half the unambiguous interval, x = 200, 1e-7; the folded tails of five scatterers stay below 2e-6.
    assert np.abs(result.data - direct).max() < 5e-6


@pytest.mark.parametrize("bistatic", [False, True])
def test_backprojection_puts_the_scatterer_on_its_pixel_with_its_phase(bistatic: bool) -> None:
    tx, rx = path(50), path(50, seed=4) + np.array([40.0, 50.0, -30.0])
    positions = (tx, rx) if bistatic else tx
    target, reflectivity = np.array([[4.0, -7.0, 1.0]]), np.array([2 * np.exp(1.1j)])
    data = simulate.points(
        positions, target, reflectivity, n_range=400, range_start=6900.0, range_spacing=0.5, wavelength=0.031, bandwidth=200e6
    )
    grid = sarfocus.ImageGrid.from_points(target)
    pixel = sarfocus.backproject(data, positions, grid, range_start=6900.0, range_spacing=0.5, wavelength=0.031)
    assert abs(pixel[0, 0] / 50 - reflectivity[0]) < 2e-3 * 2  # interpolation of backproject: -60 dB


def test_bits_depend_on_neither_threads_nor_strides() -> None:
    targets, reflectivity = scene(3)
    axis = {"n_range": 60, "range_start": 6990.0, "range_spacing": 0.5, "wavelength": 0.031, "bandwidth": 2e8, "noise_power": 0.1}
    reference = simulate.points(path(11), targets, reflectivity, **axis, threads=1)
    out = np.zeros((60, 22), np.complex64).T[::-2]
    assert simulate.points(np.asfortranarray(path(11)), targets[::1], reflectivity, **axis, threads=2, out=out) is out
    assert np.array_equal(out, reference)


def test_refusals_name_the_argument() -> None:
    targets, reflectivity = scene(3)
    axis = {"n_range": 60, "range_start": 6990.0, "range_spacing": 0.5, "wavelength": 0.031, "bandwidth": 2e8}
    with pytest.raises(sarfocus.ShapeError, match="targets"):
        simulate.points(path(4), targets[:2], reflectivity, **axis)
    with pytest.raises(sarfocus.ShapeError, match="positions"):
        simulate.points((path(4), path(5)), targets, reflectivity, **axis)
    with pytest.raises(ValueError, match="n_range"):
        simulate.points(path(4), targets, reflectivity, **{**axis, "n_range": 0})
    with pytest.raises(ValueError, match="wavelength"):
        simulate.points(path(4), targets, reflectivity, **{**axis, "wavelength": -1.0})
    with pytest.raises(TypeError, match="reflectivity"):
        simulate.points(path(4), targets, "strong", **axis)
    with pytest.raises(sarfocus.NumericalError, match="positions"):
        simulate.points(path(4) * np.nan, targets, reflectivity, **axis)
    with pytest.raises(MemoryError, match="points"):
        simulate.points(path(4), targets, reflectivity, **{**axis, "n_range": 2**45})
