"""azimuth_compress and azimuth_decompress against the equations, through every door."""

import numpy as np
import pytest
from numpy.typing import NDArray

import sarfocus
from reference import azimuth as oracle

FIELDS = {"wavelength": 0.031, "prf": 900.0, "velocity": 130.0, "doppler_centroid": 0.0}


def geometry_of(slant_range: NDArray[np.float64], **changes: float) -> sarfocus.StripmapGeometry:
    return sarfocus.StripmapGeometry(**{**FIELDS, **changes}, slant_range=slant_range, doppler_bandwidth=700.0)


def speckle(*shape: int, seed: int = 0) -> NDArray[np.complex64]:
    rng = np.random.default_rng(seed)
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)).astype(np.complex64)


@pytest.mark.parametrize("n", [1, 63, 64, 1021])
@pytest.mark.parametrize("doppler_centroid", [0.0, 450.0, -4321.0])
def test_agrees_with_the_equations(n: int, doppler_centroid: float) -> None:
    slant_range = np.array([4e3, 9e3, 9.1e3, 8.5e5])
    raw = speckle(n, 4)
    fields = {**FIELDS, "doppler_centroid": doppler_centroid}
    image = sarfocus.azimuth_compress(raw, geometry_of(slant_range, doppler_centroid=doppler_centroid))
    expected = oracle.compress(raw, **fields, slant_range=slant_range)
    # Single-precision transforms and phasors: some 1e-7 of the root mean square (1.4), five times that at the worst sample.
    assert np.abs(image - expected).max() < 5e-6


def test_compressing_the_chirp_of_a_target_focuses_it() -> None:
    """The signal exp(-j pi K (t - t0)^2), |t - t0| <= Ts/2, peaks at t0 with the energy of its aperture."""
    n, prf, bandwidth = 4096, 900.0, 700.0
    slant_range = np.array([4e3])
    k = oracle.fm_rate(FIELDS["wavelength"], FIELDS["velocity"], slant_range)[0]
    t = (np.arange(n) - 1500) / prf
    raw = np.where(np.abs(t) <= bandwidth / k / 2, np.exp(-1j * np.pi * k * t**2), 0)[:, None].astype(np.complex64)
    image = sarfocus.azimuth_compress(raw, geometry_of(slant_range))
    peak = np.abs(image[:, 0]).argmax()
    assert peak == 1500
    # Stationary phase: sqrt(bandwidth * Ts) and -45 degrees; the Fresnel ripple of 2300 samples is a few per cent.
    assert abs(image[peak, 0]) == pytest.approx(np.sqrt(bandwidth**2 / k), rel=0.03)
    assert np.angle(image[peak, 0]) == pytest.approx(-np.pi / 4, abs=0.03)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_bits_depend_on_neither_threads_nor_strides(threads: int) -> None:
    raw = speckle(777, 90)
    geometry = geometry_of(np.linspace(8e3, 9e3, 90))
    reference = sarfocus.azimuth_compress(raw, geometry, threads=1)
    wide = np.full((777, 270), np.nan, np.complex64)
    wide[:, 1::3] = raw
    out = np.zeros((180, 1554), np.complex64)
    for source in (raw, np.asfortranarray(raw), wide[:, 1::3], np.ascontiguousarray(raw[::-1, ::-1])[::-1, ::-1]):
        assert np.array_equal(sarfocus.azimuth_compress(source, geometry, threads=threads), reference)
        target = out.T[::-2, ::2]
        assert sarfocus.azimuth_compress(source, geometry, threads=threads, out=target) is target
        assert np.array_equal(target, reference)
    assert not out[1::2].any()


def test_decompress_is_the_inverse() -> None:
    image = speckle(2000, 17, seed=3)
    geometry = geometry_of(np.linspace(8e3, 9e3, 17), doppler_centroid=333.0)
    back = sarfocus.azimuth_compress(sarfocus.azimuth_decompress(image, geometry), geometry)
    assert np.linalg.norm(back - image) < 1e-6 * np.linalg.norm(image)  # the promise of the header


def test_refusals_name_the_argument() -> None:
    geometry = geometry_of(np.array([8e3, 9e3]))
    raw = speckle(50, 2)
    with pytest.raises(TypeError, match="raw: expected a NumPy array of dtype complex64"):
        sarfocus.azimuth_compress(raw.astype(np.complex128), geometry)  # type: ignore[arg-type]
    with pytest.raises(sarfocus.ShapeError, match="raw"):
        sarfocus.azimuth_compress(raw[:, :1], geometry)
    with pytest.raises(sarfocus.ShapeError, match="out"):
        sarfocus.azimuth_compress(raw, geometry, out=np.empty((50, 3), np.complex64))
    with pytest.raises(ValueError, match="overlap"):
        sarfocus.azimuth_compress(raw, geometry, out=raw)
    raw[31, 1] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"image: expected finite samples, got nan.* at \[31, 1\]"):
        sarfocus.azimuth_decompress(raw, geometry)


def test_progress_can_stop_and_its_errors_come_through() -> None:
    geometry = geometry_of(np.array([8e3, 9e3]))
    with pytest.raises(sarfocus.Cancelled):
        sarfocus.azimuth_compress(speckle(50, 2), geometry, progress=lambda *_: False)

    def fail(phase: str, done: int, total: int) -> None:
        raise KeyError(phase, done, total)

    with pytest.raises(KeyError, match="azimuth_compress"):
        sarfocus.azimuth_compress(speckle(50, 2), geometry, progress=fail)
