"""Windows, chirps and upsampling against SciPy and explicit sums."""

import numpy as np
import pytest
import scipy.signal

import sarfocus


@pytest.mark.parametrize("n", [1, 2, 3, 16, 33])
@pytest.mark.parametrize("form", ["symmetric", "periodic"])
@pytest.mark.parametrize(
    ("name", "reference"),
    [
        (None, "boxcar"),
        ("rectangular", "boxcar"),
        ("hann", "hann"),
        ("hamming", "hamming"),
        (("kaiser", 8.5), ("kaiser", 8.5)),
        (("taylor", 4, 35.0), ("taylor", 4, 35)),
        (("taylor", 7, 50.0), ("taylor", 7, 50)),
    ],
)
def test_windows_are_those_of_scipy(name: str | None, reference: str | tuple[object, ...], n: int, form: str) -> None:
    expected = scipy.signal.get_window(reference, n, fftbins=form == "periodic")
    assert np.abs(sarfocus.signal.window(name, n, form=form) - expected).max() < 1e-12  # type: ignore[arg-type]  # rounding of the cosines


@pytest.mark.parametrize("name", ["hanning", ("taylor",), ("taylor", 4), ("kaiser", "x"), (), ("kaiser", -1.0), 3])
def test_unknown_windows_are_refused(name: object) -> None:
    if name == ("taylor",):
        assert len(sarfocus.signal.window(name, 8)) == 8  # type: ignore[arg-type]
        return
    with pytest.raises((ValueError, TypeError), match=r"window|beta"):
        sarfocus.signal.window(name, 8)  # type: ignore[arg-type]


def test_chirp_fills_its_band() -> None:
    pulse = sarfocus.signal.chirp(bandwidth=60e6, duration=20e-6, sampling_rate=100e6)
    spectrum = np.abs(np.fft.fftshift(np.fft.fft(pulse))) ** 2
    f = np.fft.fftshift(np.fft.fftfreq(len(pulse), 1e-8))
    # Fresnel ripple: the share inside the band grows like 1 - 1 / (time-bandwidth product of 1200).
    assert spectrum[np.abs(f) <= 30e6].sum() / spectrum.sum() > 0.98


@pytest.mark.parametrize("shape", [(1, 1), (5, 8), (8, 5), (12, 12)])
@pytest.mark.parametrize("band_centre", [(0.0, 0.0), (0.3, -0.4)])
def test_upsample_is_the_trigonometric_interpolant(shape: tuple[int, int], band_centre: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    chip = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    factor = 3

    def matrix(n: int, centre: float) -> np.ndarray:
        """Samples of the sum of tones k / n, k = round(n centre) - n/2 ..., both edges at half weight for even n."""
        middle = int(np.floor(centre * n + 0.5))
        k = np.arange(middle - n // 2, middle + n // 2 + 1)
        weight = np.ones(len(k)) / n
        if n % 2 == 0:
            weight[[0, -1]] /= 2
        fine = np.arange(n * factor)[:, None] / factor
        return (np.exp(2j * np.pi * fine * k / n) * weight) @ np.exp(-2j * np.pi * np.outer(k, np.arange(n)) / n)

    expected = matrix(shape[0], band_centre[0]) @ chip @ matrix(shape[1], band_centre[1]).T
    fine = sarfocus.signal.upsample(chip, factor, band_centre=band_centre)
    assert np.abs(fine - expected).max() < 1e-12  # double-precision rounding of 36 x 36 sums
    assert np.abs(fine[::factor, ::factor] - chip).max() < 1e-12


def test_upsample_refuses() -> None:
    chip = np.ones((4, 4), np.complex64)
    with pytest.raises(ValueError, match="factor"):
        sarfocus.signal.upsample(chip, 0)
    with pytest.raises(TypeError, match="chip"):
        sarfocus.signal.upsample(chip.real, 2)  # type: ignore[arg-type]
    chip[1, 2] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"\[1, 2\]"):
        sarfocus.signal.upsample(chip, 2)


@pytest.mark.parametrize("n", [1, 2, 31, 32])
def test_analytic_signal_is_that_of_scipy(n: int) -> None:
    samples = np.random.default_rng(0).normal(size=(3, n))
    expected = scipy.signal.hilbert(samples, axis=1)
    for source in (samples, np.asfortranarray(samples), samples[::-1, ::-1].copy()[::-1, ::-1], samples.tolist()):
        assert np.abs(sarfocus.signal.analytic_signal(source, threads=2) - expected).max() < 1e-6  # rounding to single precision
    with pytest.raises(ValueError, match="wavelength"):
        sarfocus.signal.demodulate(samples, range_start=0.0, range_spacing=0.01, wavelength=0.0)
    with pytest.raises(TypeError, match="samples"):
        sarfocus.signal.analytic_signal("impulse")


def test_demodulated_impulse_focuses_by_backprojection() -> None:
    """A real-valued impulse radar on a line: the pixel on the scatterer is n_pulse times the pulse's peak, phase zero."""
    wavelength, spacing, start = 299_792_458.0 / 4.1e9, 0.00915, 2.0
    positions = np.stack([np.linspace(-1, 1, 80), np.zeros(80), np.full(80, 0.5)], axis=1)
    target = np.array([[0.21, 4.03, 0.0]])
    x = start + spacing * np.arange(600) - np.linalg.norm(positions - target, axis=1)[:, None]
    samples = np.exp(-0.5 * (x / 0.08) ** 2) * np.cos(4 * np.pi * x / wavelength)
    data = sarfocus.signal.demodulate(samples, range_start=start, range_spacing=spacing, wavelength=wavelength)
    grid = sarfocus.ImageGrid.from_points(target)
    pixel = sarfocus.backproject(data, positions, grid, range_start=start, range_spacing=spacing, wavelength=wavelength)
    assert abs(pixel[0, 0] / 80 - 1) < 1e-3  # interpolation of backproject: -60 dB
