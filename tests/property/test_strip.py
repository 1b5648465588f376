"""What stripmap autofocus must not depend on: gauge, scale, phase, place and direction; on random errors and scenes."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import sarfocus
from reference.strip import without_line
from sarfocus import strip

N, GATES = 768, 24
GEOMETRY = sarfocus.StripmapGeometry(
    wavelength=0.03125, prf=240.0, velocity=120.0, slant_range=4000 + 0.5 * np.arange(GATES), doppler_bandwidth=200.0
)
K = np.arange(N)
SEEDS = st.integers(0, 2**32 - 1)


def random_phase(rng: np.random.Generator) -> NDArray[np.float64]:
    """A few slow waves of a few radians."""
    waves = rng.normal(0, 2.0, 6) * np.sin(np.pi * np.outer(K / N, np.arange(2, 8)) + rng.uniform(0, 2 * np.pi, 6))
    return np.asarray(waves.sum(1))


def random_raw(rng: np.random.Generator) -> NDArray[np.complex64]:
    """Twenty points 33 dB over clutter before compression, none nearer to an end than half an aperture."""
    azimuth = np.linspace(110, N - 110, 20).round() + rng.integers(-6, 7, 20)
    points = np.stack([azimuth, rng.permutation(GATES)[:20]], 1)
    amplitude = 10 ** (33 / 20) * np.exp(2j * np.pi * rng.random(20))
    return sarfocus.simulate.stripmap(GEOMETRY, points, amplitude, n_azimuth=N, clutter_power=1.0, seed=int(rng.integers(2**31)))


def compressed(raw: NDArray[np.complex64], phase: NDArray[np.float64]) -> NDArray[np.complex64]:
    return sarfocus.azimuth_compress((raw * np.exp(1j * phase)[:, None]).astype(np.complex64), GEOMETRY)


def estimate(image: NDArray[np.complex64]) -> sarfocus.Result:
    return sarfocus.spga_linear(image, GEOMETRY, do_no_harm=False)


def rms(phase: NDArray[np.float64]) -> float:
    return float(np.std(without_line(phase)))


@settings(max_examples=12)
@given(SEEDS, st.floats(-np.pi, np.pi), st.integers(-6, 6))
def test_a_constant_and_a_line_of_the_error_are_the_gauge(seed: int, constant: float, pixels: int) -> None:
    rng = np.random.default_rng(seed)
    raw, phase = random_raw(rng), random_phase(rng)
    # A whole number of cycles over the strip moves everything and turns nothing at the ends; so many are some pixels.
    cycles = round(pixels * GEOMETRY.fm_rate(0) / GEOMETRY.prf**2 * N)
    line = constant + 2 * np.pi * cycles * K / N
    first, second = estimate(compressed(raw, phase)), estimate(compressed(raw, phase + line))
    found = np.isfinite(first.phase_std) & np.isfinite(second.phase_std)
    assert found.mean() > 0.8
    # K differs by 0.3 % from gate to gate and other pixels of clutter lie in the windows: of the order of the error itself, which a few
    # slow waves make up. Of 400 random strips the difference is within 0.36 of what is stated for half, 1.7 for 99 %, 2.5 for all.
    stated = np.sqrt(np.mean(first.phase_std[found] ** 2))
    assert rms((first.estimate - second.estimate)[found]) < 3 * stated + 0.02
    # Nobody is moved on average: the common shift stays in the image, by slope / (2 pi K) [Xie2023, eq. 4].
    expected = cycles / N * GEOMETRY.prf**2 / GEOMETRY.fm_rate(GATES // 2)
    apart = []
    for p in first.points:
        distance = second.points["azimuth"][second.points["range"] == p["range"]] - p["azimuth"]
        if distance.size:
            apart.append(distance[np.argmin(abs(distance - expected))])
    # All alike; by how much is known as well as where twenty points lay that were spread over tens of pixels.
    assert np.median(abs(apart - np.median(apart))) < 0.2
    assert abs(np.median(apart) - expected) < 4.0


@settings(max_examples=10)
@given(SEEDS, st.floats(-np.pi, np.pi), st.floats(-8, 8))
def test_scale_and_phase_of_the_image_do_not_matter(seed: int, turn: float, magnitude: float) -> None:
    rng = np.random.default_rng(seed)
    image = compressed(random_raw(rng), random_phase(rng))
    factor = np.complex64(10**magnitude * np.exp(1j * turn))
    first, second = estimate(image), estimate(image * factor)
    assert first.status is second.status
    # Rounding to single precision, and where the rounds of the refinement end: 1e-3 rad.
    assert rms(first.estimate - second.estimate) < 5e-3
    scale = np.abs(image).max()
    assert np.abs(second.image / factor - first.image).max() < 2e-2 * scale


@settings(max_examples=10)
@given(SEEDS, st.integers(1, 60))
def test_a_shifted_strip_has_a_shifted_error(seed: int, shift: int) -> None:
    rng = np.random.default_rng(seed)
    image = compressed(random_raw(rng), random_phase(rng))
    first, second = estimate(image), estimate(np.roll(image, shift, axis=0))
    found = np.isfinite(first.phase_std[: N - shift]) & np.isfinite(second.phase_std[shift:])
    inner = found & (K[: N - shift] > 110) & (K[: N - shift] < N - shift - 110)
    # Away from the ends the same samples of the same points, in other boxes, sections and knots; near them apertures are cut off elsewhere.
    stated = np.sqrt(np.mean(first.phase_std[: N - shift][inner] ** 2))
    assert rms((first.estimate[: N - shift] - second.estimate[shift:])[inner]) < 2 * stated + 0.02


@settings(max_examples=10)
@given(SEEDS)
def test_a_strip_read_backwards_has_the_error_backwards(seed: int) -> None:
    """Without a Doppler centroid the filter is even in frequency, so that compression commutes with the reversal of slow time."""
    rng = np.random.default_rng(seed)
    image = compressed(random_raw(rng), random_phase(rng))
    backwards = np.ascontiguousarray(image[::-1])
    first, second = estimate(image), estimate(backwards)
    found = np.isfinite(first.phase_std) & np.isfinite(second.phase_std[::-1])
    stated = np.sqrt(np.mean(first.phase_std[found] ** 2))
    assert rms((first.estimate - second.estimate[::-1])[found]) < 2 * stated + 0.02


@settings(max_examples=15)
@given(SEEDS, st.integers(1, 4))
def test_correcting_twice_is_correcting_by_the_sum(seed: int, blocks: int) -> None:
    rng = np.random.default_rng(seed)
    image = (rng.normal(size=(200, GATES)) + 1j * rng.normal(size=(200, GATES))).astype(np.complex64)
    centres = np.sort(rng.choice(4 * GATES, blocks, replace=False) / 4.0)
    first, second = rng.normal(0, 3, (2, blocks, 200))
    twice = strip.azimuth_correct(strip.azimuth_correct(image, GEOMETRY, first, centres=centres), GEOMETRY, second, centres=centres)
    once = strip.azimuth_correct(image, GEOMETRY, first + second, centres=centres)
    # Eight transforms and two factors in single precision, samples of size 1.4.
    assert np.abs(twice - once).max() < 2e-5
    assert np.abs(np.linalg.norm(twice) / np.linalg.norm(image) - 1) < 1e-5
