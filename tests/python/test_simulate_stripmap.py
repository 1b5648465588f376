"""simulate.stripmap, stripmap_echo and motion_error: the equations, the compressed image, the statistics."""

import numpy as np
import pytest
from numpy.typing import NDArray

import sarfocus
from reference import azimuth as azimuth_oracle
from reference import echoes
from sarfocus import simulate

CLUTTER = 2  # number of the clutter stream
FIELDS = {"wavelength": 0.031, "prf": 600.0, "velocity": 120.0}


def geometry_of(n_range: int, doppler_centroid: float = 0.0, bandwidth: float = 450.0, start: float = 4000.0) -> sarfocus.StripmapGeometry:
    return sarfocus.StripmapGeometry(
        **FIELDS, slant_range=start + 0.5 * np.arange(n_range), doppler_bandwidth=bandwidth, doppler_centroid=doppler_centroid
    )


def image_of(strip: NDArray[np.complex64], geometry: sarfocus.StripmapGeometry) -> NDArray[np.complex128]:
    return azimuth_oracle.compress(strip, **FIELDS, slant_range=geometry.slant_range, doppler_centroid=geometry.doppler_centroid)


@pytest.mark.parametrize("n", [1024, 1001])
@pytest.mark.parametrize("doppler_centroid", [0.0, 200.0, -5000.0])
def test_band_limited_strip_compresses_to_the_exact_sinc(n: int, doppler_centroid: float) -> None:
    geometry = geometry_of(3, doppler_centroid)
    position, reflectivity = 411.375, 2.0 * np.exp(0.6j)
    strip = simulate.stripmap(geometry, [(position, 1)], [reflectivity], n_azimuth=n)
    f = azimuth_oracle.baseband_frequency(n, 600.0, doppler_centroid)
    inside = f[(f - doppler_centroid >= -225.0) & (f - doppler_centroid < 225.0)]
    i = np.arange(n)
    expected = reflectivity * np.exp(2j * np.pi * np.outer(i - position, inside) / 600.0).mean(axis=1)
    image = image_of(strip, geometry)
    assert np.abs(image[:, 1] - expected).max() < 1e-6  # the strip is rounded to single precision: 3e-8 of sqrt(n) samples
    assert not image[:, [0, 2]].any()


def test_the_library_compresses_its_strip_with_the_sidelobes_of_a_sinc() -> None:
    geometry = geometry_of(1)
    strip = simulate.stripmap(geometry, [(1000, 0)], [1], n_azimuth=2048)
    image = sarfocus.azimuth_compress(strip, geometry)
    fine = np.abs(sarfocus.signal.upsample(image[984:1016].copy(), 32)[:, 0])
    peak = fine.argmax()
    assert peak == 16 * 32
    assert abs(image[1000, 0] - 1) < 1e-6  # single-precision transforms
    beyond = np.concatenate([fine[: peak - 48], fine[peak + 48 :]])  # the null is 1.33 samples, 43 fine ones, from the peak
    # The chip of 32 samples is continued periodically: a few hundredths of a dB.
    assert 20 * np.log10(beyond[32:-32].max()) == pytest.approx(-13.26, abs=0.1)


def test_chirp_model_is_the_truncated_signal_and_compresses_to_its_reflectivity() -> None:
    geometry = geometry_of(2, doppler_centroid=100.0)
    k = azimuth_oracle.fm_rate(FIELDS["wavelength"], FIELDS["velocity"], geometry.slant_range)[1]
    strip = simulate.stripmap(geometry, [(2000.5, 1)], [3j], n_azimuth=4096, model="chirp")
    t = (np.arange(4096) - 2000.5) / 600.0
    expected = 3j * np.exp(1j * np.pi / 4) / np.sqrt(450.0**2 / k) * np.exp(-1j * np.pi * k * t**2 + 2j * np.pi * 100.0 * t)
    assert np.abs(strip[:, 1] - np.where(np.abs(t) <= 225.0 / k, expected, 0)).max() < 1e-7
    image = image_of(simulate.stripmap(geometry, [(2000, 1)], [3j], n_azimuth=4096, model="chirp"), geometry)
    assert abs(image[2000, 1] / 3j - 1) < 0.03  # Fresnel ripple of an aperture of 900 cycles squared


def test_clutter_is_the_published_generator_within_the_band() -> None:
    geometry = geometry_of(2, doppler_centroid=-250.0)
    n = 96
    image = image_of(simulate.stripmap(geometry, [], [], n_azimuth=n, clutter_power=4.0, seed=9), geometry)
    f = azimuth_oracle.baseband_frequency(n, 600.0, -250.0) + 250.0
    inside = (f >= -225.0) & (f < 225.0)
    drawn = echoes.complex_normal(9, CLUTTER, 2 * n).reshape(2, n).T
    expected = np.fft.ifft(np.where(inside[:, None], drawn, 0), axis=0) * n * np.sqrt(4.0 / inside.sum())
    assert np.abs(image - expected).max() < 2e-6  # single-precision strip, values to 6


def test_clutter_and_noise_have_their_powers() -> None:
    geometry = geometry_of(64)
    clutter = sarfocus.azimuth_compress(simulate.stripmap(geometry, [], [], n_azimuth=2048, clutter_power=2.0, seed=1), geometry)
    noise = simulate.stripmap(geometry, [], [], n_azimuth=2048, noise_power=3.0, seed=1)
    # 98304 independent values of the band (131072 of noise), the power of each with a standard deviation of 1: five of the mean's.
    assert np.mean(np.abs(clutter) ** 2) == pytest.approx(2.0, rel=5 / np.sqrt(98304))
    assert np.mean(np.abs(noise) ** 2) == pytest.approx(3.0, rel=5 / np.sqrt(131072))
    again = simulate.stripmap(geometry, [], [], n_azimuth=2048, clutter_power=2.0, seed=2)
    assert not np.array_equal(again, simulate.stripmap(geometry, [], [], n_azimuth=2048, clutter_power=2.0, seed=3))


def test_linear_phase_error_shifts_the_image() -> None:
    """A linear phase error over slow time is a frequency f0, and so a shift by f0 / K."""
    geometry = geometry_of(1)
    n, f0 = 2048, 600.0 * 20 / 2048
    k = azimuth_oracle.fm_rate(FIELDS["wavelength"], FIELDS["velocity"], geometry.slant_range)[0]
    error = 2 * np.pi * f0 * np.arange(n) / 600.0
    image = image_of(simulate.stripmap(geometry, [(1000, 0)], [1], n_azimuth=n, phase_error=error), geometry)
    # exp(-j pi K (t - t0)^2 + 2j pi f0 t) is the same chirp about t0 + f0 / K.
    assert abs(np.abs(image[:, 0]).argmax() - (1000 + f0 / k * 600.0)) <= 0.5


def test_echo_with_migration_backprojects_to_its_targets() -> None:
    """The hyperbola is that of a straight path: an independent former brings every target to its place, with its phase."""
    geometry = geometry_of(160, start=1500.0)
    targets, reflectivity = [(600.0, 40.25), (700.5, 80.0)], np.array([1.0, 2j])
    n = 1300
    echo = simulate.stripmap_echo(geometry, targets, reflectivity, n_azimuth=n, range_bandwidth=250e6)
    positions = np.stack([np.arange(n) * 0.2, np.zeros(n), np.zeros(n)], axis=1)
    points = np.array([[600 * 0.2, 1500 + 0.5 * 40.25, 0], [700.5 * 0.2, 1540.0, 0]])
    pixels = sarfocus.backproject(
        echo, positions, sarfocus.ImageGrid.from_points(points), range_start=1500.0, range_spacing=0.5, wavelength=FIELDS["wavelength"]
    )[:, 0]
    distance = np.linalg.norm(points[:, None] - positions, axis=2)
    doppler = -2 * FIELDS["velocity"] * (positions[:, 0] - points[:, :1]) / (FIELDS["wavelength"] * distance)
    pulses = (np.abs(doppler) <= 225.0).sum(axis=1)
    assert pulses.min() > 300
    assert np.abs(pixels / pulses - reflectivity).max() < 0.02  # sidelobes of the other target 20 m away


@pytest.mark.parametrize("model", ["band_limited", "chirp", "echo"])
def test_bits_depend_on_neither_threads_nor_strides(model: str) -> None:
    geometry = geometry_of(21, doppler_centroid=80.0)
    effects = {"noise_power": 0.1, "seed": 2, "phase_error": np.linspace(0, 9, 150)}

    def run(**more: object) -> NDArray[np.complex64]:
        if model == "echo":
            return simulate.stripmap_echo(geometry, [(70, 3)], [1], n_azimuth=150, range_bandwidth=2e8, **effects, **more)  # type: ignore[arg-type]
        return simulate.stripmap(geometry, [(70, 3)], [1], n_azimuth=150, model=model, clutter_power=0.5, **effects, **more)  # type: ignore[arg-type]

    reference = run(threads=1)
    out = np.zeros((42, 150), np.complex64).T[::-1, ::2]
    assert run(threads=2, out=out) is out
    assert np.array_equal(out, reference)


def test_motion_error_adds_its_parts() -> None:
    t = (np.arange(500) - 249.5) / 100.0
    smooth = simulate.motion_error(500, prf=100.0, drift=0.3, acceleration=-0.2)
    assert np.abs(smooth - (0.3 * t - 0.1 * t**2)).max() < 1e-13
    shaken = simulate.motion_error(500, prf=100.0, vibrations=[(0.01, 12.0), (0.02, 31.0)], seed=4, axes=3)
    assert shaken.shape == (500, 3)
    for column in shaken.T:
        lines = np.abs(np.fft.rfft(column)) / 250
        assert lines[60] == pytest.approx(0.01, abs=1e-12)
        assert lines[155] == pytest.approx(0.02, abs=1e-12)
    assert not np.allclose(shaken[:, 0], shaken[:, 1])
    both = simulate.motion_error(500, prf=100.0, drift=0.3, acceleration=-0.2, random_rms=0.1, random_bandwidth=3.0, seed=4)
    slow = simulate.motion_error(500, prf=100.0, random_rms=0.1, random_bandwidth=3.0, seed=4)
    assert np.abs(both - slow - smooth).max() < 1e-13
    assert np.array_equal(slow, simulate.motion_error(500, prf=100.0, random_rms=0.1, random_bandwidth=3.0, seed=4, axes=2)[:, 0])


def test_random_motion_keeps_to_its_band_and_rms() -> None:
    draws = np.array([simulate.motion_error(1000, prf=200.0, random_rms=0.05, random_bandwidth=4.0, seed=s) for s in range(200)])
    # 40 modes in 200 draws: five standard deviations of the mean square are 5 / sqrt(8000).
    assert np.mean(draws**2) == pytest.approx(0.05**2, rel=0.06)
    spectrum = np.mean(np.abs(np.fft.rfft(draws * np.hanning(1000), axis=1)) ** 2, axis=0)
    frequency = np.fft.rfftfreq(1000, 1 / 200)
    assert spectrum[frequency > 5].sum() < 1e-3 * spectrum[frequency < 4].sum()


def test_refusals_name_the_argument() -> None:
    geometry = geometry_of(4)
    with pytest.raises(ValueError, match=r"targets\[0, 1\]"):
        simulate.stripmap(geometry, [(3, 0.5)], [1], n_azimuth=64)
    with pytest.raises(sarfocus.ShapeError, match="targets"):
        simulate.stripmap(geometry, [(3, 1, 2)], [1], n_azimuth=64)
    with pytest.raises(sarfocus.ShapeError, match="phase_error"):
        simulate.stripmap(geometry, [], [], n_azimuth=64, phase_error=[])
    with pytest.raises(sarfocus.NumericalError, match="phase_error"):
        simulate.stripmap(geometry, [], [], n_azimuth=2, phase_error=[0, np.nan])
    with pytest.raises(ValueError, match="doppler_bandwidth"):
        simulate.stripmap(geometry_of(4, doppler_centroid=5.0, bandwidth=1e-3), [(3, 1)], [1], n_azimuth=63, clutter_power=1.0)
    with pytest.raises(ValueError, match="model"):
        simulate.stripmap(geometry, [], [], n_azimuth=64, model="exact")  # type: ignore[arg-type]
    with pytest.raises(sarfocus.ShapeError, match="out"):
        simulate.stripmap(geometry, [], [], n_azimuth=64, out=np.empty((64, 5), np.complex64))
    with pytest.raises(ValueError, match="range_bandwidth"):
        simulate.stripmap_echo(geometry, [], [], n_azimuth=64, range_bandwidth=4e8)
    with pytest.raises(ValueError, match=r"vibrations\[0\]"):
        simulate.motion_error(10, prf=10.0, vibrations=[(1.0, 6.0)])
    with pytest.raises(ValueError, match="axes"):
        simulate.motion_error(10, prf=10.0, axes=0)
