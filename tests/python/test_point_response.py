"""sarfocus.quality.point_response against explicit sums over a band and against the definitions."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import windows

from reference import quality as oracle
from sarfocus import NumericalError, quality


def band_response(x: NDArray[np.float64], weights: NDArray[np.float64], cell: float, centre: float = 0.0) -> NDArray[np.complex128]:
    """Sum over a band of equal parts; `cell` samples a resolution cell, centred at `centre` cycles per sample."""
    part = (np.arange(weights.size) + 0.5) / weights.size - 0.5
    steps = np.exp(2j * np.pi * np.multiply.outer(x, part / cell + centre)) @ weights / weights.sum()
    return np.asarray(steps * np.sinc(x / cell / weights.size))


def point_image(
    shape: tuple[int, int], position: tuple[float, float], weights: NDArray[np.float64], cell: tuple[float, float], centre: float = 0.0
) -> NDArray[np.complex64]:
    azimuth = band_response(np.arange(shape[0]) - position[0], weights, cell[0], centre)
    slant_range = band_response(np.arange(shape[1]) - position[1], np.ones(1), cell[1])
    return np.multiply.outer(azimuth, slant_range).astype(np.complex64)


@pytest.mark.parametrize("lobes", [5, 10, 20])
@pytest.mark.parametrize("cell", [1.1, 1.7])
def test_unweighted_figures_are_those_of_the_definition(cell: float, lobes: int) -> None:
    image = point_image((301, 257), (150.37, 120.81), np.ones(1), (cell, cell))
    response = quality.point_response(image, (150, 121), lobes=lobes, oversampling=cell)
    step = 1 / 512
    irw, pslr, islr = oracle.cut_figures(np.sinc(np.arange(-(lobes + 2), lobes + 2 + step / 2, step)) ** 2, step, lobes)
    for axis, position in ((response.azimuth, 150.37), (response.range, 120.81)):
        assert axis.position == pytest.approx(position, abs=0.002)
        # Tails beyond the chip: 0.002 dB at these oversamplings; grid of 1/32 pixel: 1e-3 of the width.
        assert axis.irw_cells == pytest.approx(irw, abs=1e-3)
        assert axis.pslr_db == pytest.approx(pslr, abs=0.01)
        assert axis.islr_db == pytest.approx(islr, abs=0.01)
        assert axis.theory_islr_db == pytest.approx(islr, abs=0.01)
        assert axis.verdict == "good"
    assert "verdict='good'" in repr(response)


def test_published_figures_of_the_unweighted_response() -> None:
    image = point_image((511, 511), (255.25, 255.5), np.ones(1), (1.0, 1.0))
    response = quality.point_response(image, (255, 255), oversampling=1.0)
    assert response.azimuth.irw_cells == pytest.approx(0.886, abs=0.002)
    assert response.azimuth.pslr_db == pytest.approx(-13.26, abs=0.02)  # critical sampling, the worst offset
    assert response.azimuth.islr_db == pytest.approx(-10.11, abs=0.03)  # ten lobes; -9.68 over all of them


@pytest.mark.parametrize("name", ["taylor", "hamming", "hann", "kaiser"])
def test_windows_are_recognised(name: str) -> None:
    # 2^-8 of the band a part: a stair-case of the window raises no lobe above -60 dB inside the extent.
    weights = {
        "taylor": windows.taylor(256, nbar=5, sll=30, sym=True),
        "hamming": windows.hamming(256),
        "hann": windows.hann(256),
        "kaiser": windows.kaiser(256, 4.0),
    }[name]
    image = point_image((255, 255), (127.3, 127.6), weights, (1.3, 1.2))
    response = quality.point_response(image, (127, 128), oversampling=(1.3, 1.2), window=(weights, None))
    assert response.verdict == "good"
    # Side lobes at -43 dB measured on samples of 24 bits; theory on a grid of 1/32 cell.
    assert response.azimuth.pslr_db == pytest.approx(response.azimuth.theory_pslr_db, abs=0.05)
    assert response.azimuth.islr_db == pytest.approx(response.azimuth.theory_islr_db, abs=0.05)
    assert response.azimuth.irw_cells == pytest.approx(response.azimuth.theory_irw_cells, rel=2e-3)
    if name == "hamming":
        assert response.azimuth.pslr_db == pytest.approx(-42.7, abs=0.3)  # the textbook's rounded figure
    assert quality.point_response(image, (127, 128), oversampling=(1.3, 1.2)).azimuth.verdict == "broadened"


@pytest.mark.parametrize("centre", [-0.37, 0.12, 0.45])
def test_spectrum_away_from_zero_doppler(centre: float) -> None:
    image = point_image((255, 255), (127.3, 127.6), np.ones(1), (1.25, 1.25), centre)
    # Clutter of the same band, 35 dB below: its energy must not fill the gap. Noise of the full band, 50 dB below.
    rng = np.random.default_rng(4)
    spectrum = rng.normal(size=(255, 255)) + 1j * rng.normal(size=(255, 255))
    spectrum[np.abs(np.angle(np.exp(2j * np.pi * (np.fft.fftfreq(255) - centre)))) > np.pi / 1.25] = 0
    clutter = np.fft.ifft2(spectrum)
    noise = rng.normal(size=image.shape) + 1j * rng.normal(size=image.shape)
    full = (image + clutter / clutter.std() * 10 ** (-35 / 20) + noise * 10 ** (-50 / 20)).astype(np.complex64)
    response = quality.point_response(full, (127, 128), oversampling=1.25)
    # Interference of 1.8 % in amplitude: 0.02 pixel, and 0.7 dB on a side lobe of 0.217 (20 log10(1 + 0.018 / 0.217)), twice as a bound.
    assert response.azimuth.position == pytest.approx(127.3, abs=0.04)
    assert response.azimuth.pslr_db == pytest.approx(-13.26, abs=1.4)
    assert response.azimuth.irw_cells == pytest.approx(0.886, abs=0.03)
    assert response.verdict in ("good", "asymmetric", "high_sidelobes")


def test_cut_is_the_response() -> None:
    image = point_image((255, 255), (127.3, 127.6), np.ones(1), (1.25, 1.25))
    axis = quality.point_response(image, (127, 128), oversampling=1.25).azimuth
    # 255 samples of a response that falls like 1/x: 0.1 % of the peak.
    np.testing.assert_allclose(axis.cut, np.abs(np.sinc((axis.cut_position - 127.3) / 1.25)), atol=2e-3)
    assert axis.extent == pytest.approx((13.75, 13.75), abs=1e-2)
    assert axis.nulls == pytest.approx((1.25, 1.25), abs=5e-3)


def test_any_layout() -> None:
    image = point_image((200, 150), (100.3, 70.6), np.ones(1), (1.25, 1.4))
    strided = np.zeros((300, 400), np.complex64)[:150, ::-2].T
    strided[:] = image
    expected = quality.point_response(image, (100, 70))
    actual = quality.point_response(strided, (100, 70))
    assert repr(actual) == repr(expected)
    swapped = quality.point_response(image.T, (70, 100))
    assert swapped.range.pslr_db == pytest.approx(expected.azimuth.pslr_db, abs=1e-6)  # the other order of two sums


def test_refusals_name_the_argument() -> None:
    image = point_image((64, 64), (30.0, 30.0), np.ones(1), (1.2, 1.2))
    with pytest.raises(NumericalError, match="got only zeros"):
        quality.point_response(np.zeros((64, 64), np.complex64), (3, 3))
    with pytest.raises(ValueError, match=r"azimuth position: expected a pixel from 0 to 63, got 64"):
        quality.point_response(image, (64, 3))
    with pytest.raises(ValueError, match="upsample"):
        quality.point_response(image, (30, 30), upsample=1)
    with pytest.raises(ValueError, match="oversampling: expected one value, or a tuple"):
        quality.point_response(image, (30, 30), oversampling=(1.0, 1.0, 1.0))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="band_centre: expected a number"):
        quality.point_response(image, (30, 30), band_centre="0")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="window"):
        quality.point_response(image, (30, 30), window="hann")
    with pytest.raises(ValueError, match="chip: expected at least"):
        quality.point_response(image, (30, 30), oversampling=1.2, chip=15)
    image[33, 30] = np.nan
    with pytest.raises(NumericalError, match=r"\[33, 30\]"):
        quality.point_response(image, (30, 30))
