"""range_compress and compress_frequency: peaks at the right range with the right phase, oracles, strides, threads, refusals."""

import numpy as np
import pytest
from numpy.typing import NDArray

import sarfocus
from reference import compression as oracle

C = oracle.C


def speckle(*shape: int, seed: int = 0) -> NDArray[np.complex64]:
    rng = np.random.default_rng(seed)
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)).astype(np.complex64)


@pytest.mark.parametrize("origin", [0, 20, 63])
@pytest.mark.parametrize("window", [None, "hamming", ("taylor", 5, 40.0), ("kaiser", 3.0)])
def test_chirp_compression_is_the_correlation(origin: int, window: str | tuple[str | float, ...] | None) -> None:
    replica = sarfocus.signal.chirp(bandwidth=40e6, duration=1.28e-6, sampling_rate=50e6)
    raw = speckle(3, 500)
    weights = sarfocus.signal.window(window, len(replica))
    expected = oracle.correlate(raw, replica, weights, origin)
    # Single precision: 1e-7 of an input of size 1.4, times log2 of the transform.
    assert np.abs(sarfocus.range_compress(raw, replica, replica_origin=origin, window=window) - expected).max() < 2e-6


@pytest.mark.parametrize("direction", ["up", "down"])
def test_chirp_echo_peaks_at_its_range_with_its_phase(direction: str) -> None:
    """Range 5012.34 m, 9.6 GHz: the echo of the pulse's middle is exp(-4j pi R / wavelength) times the pulse, 2 R / c late."""
    rate, bandwidth, duration, wavelength = 200e6, 150e6, 4e-6, C / 9.6e9
    spacing, start, target = C / (2 * rate), 4500.0, 5012.34
    replica = sarfocus.signal.chirp(bandwidth=bandwidth, duration=duration, sampling_rate=rate, direction=direction)  # type: ignore[arg-type]
    t = 2 * (start + spacing * np.arange(2048) - target) / C
    sign = 1 if direction == "up" else -1
    echo = np.where(np.abs(t) < duration / 2, np.exp(sign * 1j * np.pi * bandwidth / duration * t**2), 0) * np.exp(
        -4j * np.pi * target / wavelength
    )
    image = sarfocus.range_compress(echo[None].astype(np.complex64), replica, replica_origin=(len(replica) - 1) / 2)
    fine = sarfocus.signal.upsample(image[:, 400:1200].copy(), 16)[0]
    peak = np.abs(fine).argmax()
    # 1 / 800 of the pulse's samples differ at its ends; 1/16 sample grid.
    assert start + spacing * (400 + peak / 16) == pytest.approx(target, abs=spacing / 16)
    assert abs(fine[peak] * np.exp(4j * np.pi * target / wavelength) - 1) < 0.01


def test_frequency_compression_keeps_the_carrier_phase_of_every_scatterer() -> None:
    frequency = 9.288e9 + 1.47e6 * np.arange(100)
    reference_range = np.array([10160.0, 10161.25, 10159.5])
    ranges = reference_range[:, None] + np.array([[-20.3, 33.1], [-20.0, 32.0], [-19.0, 31.0]])
    reflectivity = np.array([0.8 - 0.6j, 2.0])
    history = oracle.phase_history(frequency, reference_range, ranges, reflectivity).astype(np.complex64)
    result = sarfocus.compress_frequency(
        history, frequency_start=9.288e9, frequency_spacing=1.47e6, reference_range=reference_range, window="hamming"
    )
    assert result.wavelength == pytest.approx(C / frequency.mean(), rel=1e-14)
    weights = sarfocus.signal.window("hamming", 100)
    for p in range(3):
        r = result.range_start[p] + result.range_spacing * np.arange(result.data.shape[1])
        expected = oracle.matched_filter(history[p], frequency, weights, reference_range[p], r) * np.exp(
            -4j * np.pi * r / result.wavelength
        )
        assert np.abs(result.data[p] - expected).max() < 2e-6  # single-precision transform, amplitudes to 2.5
    # The sample rate is above Nyquist and the interval is whole: the peak of the first scatterer can be read off.
    line = result.data[0] * np.exp(4j * np.pi * ranges[0, 0] / result.wavelength)
    near = np.abs(result.range_start[0] + result.range_spacing * np.arange(len(line)) - ranges[0, 0]).argmin()
    assert abs(np.angle(line[near] / reflectivity[0])) < 0.02  # the other scatterer's sidelobe, -43 dB


def test_backprojection_of_compressed_data_focuses_with_the_phase_of_the_scatterer() -> None:
    """The conventions of compress_frequency and backproject meet: a pixel on the scatterer is n_pulse times its reflectivity."""
    angle = np.deg2rad(np.linspace(-1, 1, 64))
    positions = 7000.0 * np.stack([np.sin(angle), -np.cos(angle), np.full(64, 0.8)], axis=1)
    target, reflectivity = np.array([3.0, -5.0, 0.5]), np.array([1.5 * np.exp(0.7j)])
    reference_range = np.linalg.norm(positions, axis=1)
    ranges = np.linalg.norm(positions - target, axis=1)[:, None]
    frequency = 9.5e9 + 2e6 * np.arange(150)
    history = oracle.phase_history(frequency, reference_range, ranges, reflectivity).astype(np.complex64)
    result = sarfocus.compress_frequency(history, frequency_start=9.5e9, frequency_spacing=2e6, reference_range=reference_range)
    grid = sarfocus.ImageGrid.from_points(target[None])
    pixel = sarfocus.backproject(
        result.data, positions, grid, range_start=result.range_start, range_spacing=result.range_spacing, wavelength=result.wavelength
    )
    assert abs(pixel[0, 0] / 64 - reflectivity[0]) < 2e-3  # interpolation of backproject: -60 dB


def test_bits_depend_on_neither_threads_nor_strides() -> None:
    raw = speckle(21, 300)
    replica = sarfocus.signal.chirp(bandwidth=40e6, duration=1.28e-6, sampling_rate=50e6)
    axis = {"frequency_start": 9e9, "frequency_spacing": 1e6, "reference_range": 8e3}
    reference = sarfocus.range_compress(raw, replica, threads=1)
    compressed = sarfocus.compress_frequency(raw, **axis, threads=1).data
    for threads in (1, 2):
        for source in (raw, np.asfortranarray(raw), np.ascontiguousarray(raw[::-1, ::-1])[::-1, ::-1], np.repeat(raw, 2, axis=1)[:, ::2]):
            assert np.array_equal(sarfocus.range_compress(source, replica, threads=threads), reference)
            target = np.empty((compressed.shape[1], 21), np.complex64).T
            assert np.array_equal(sarfocus.compress_frequency(source, **axis, threads=threads, out=target).data, compressed)


def test_refusals_name_the_argument() -> None:
    raw = speckle(4, 64)
    axis = {"frequency_start": 9e9, "frequency_spacing": 1e6}
    with pytest.raises(sarfocus.ShapeError, match="reference_range"):
        sarfocus.compress_frequency(raw, **axis, reference_range=np.ones(3))
    with pytest.raises(sarfocus.ShapeError, match="out"):
        sarfocus.compress_frequency(raw, **axis, reference_range=1e3, out=raw.copy())
    with pytest.raises(ValueError, match="window"):
        sarfocus.compress_frequency(raw, **axis, reference_range=1e3, window="hanning")
    with pytest.raises(ValueError, match="frequency_spacing"):
        sarfocus.compress_frequency(raw, frequency_start=9e9, frequency_spacing=0.0, reference_range=1e3)
    with pytest.raises(sarfocus.NumericalError, match="reference_range"):
        sarfocus.compress_frequency(raw, **axis, reference_range=[1.0, 2.0, np.inf, 4.0])
    with pytest.raises(sarfocus.NumericalError, match="replica"):
        sarfocus.range_compress(raw, np.full(5, np.nan, np.complex64))
    raw[2, 5] = np.inf
    with pytest.raises(sarfocus.NumericalError, match=r"phase_history.*\[2, 5\]"):
        sarfocus.compress_frequency(raw, **axis, reference_range=1e3)
    with pytest.raises(sarfocus.NumericalError, match=r"raw.*\[2, 5\]"):
        sarfocus.range_compress(raw, np.ones(5, np.complex64))
