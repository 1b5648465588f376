"""form_stripmap: the exact sum, backprojection of the same echo, raw pulses, autofocus after it, refusals."""

import numpy as np
import pytest
from numpy.typing import NDArray

import sarfocus
from reference import range_doppler as oracle
from sarfocus import quality, simulate

C = oracle.C
WAVELENGTH, PRF, VELOCITY = 0.031, 640.0, 120.0
START, SAMPLING, BAND = 4000.0, 180e6, 150e6
SPACING = C / (2 * SAMPLING)
COLLECTION = {"wavelength": WAVELENGTH, "prf": PRF, "velocity": VELOCITY}
FAST_TIME = {"range_start": START, "range_sampling": SAMPLING}
SQUINTS = [0.0, -150.0, 400.0]  # Hz: broadside, 1.1 and 3 degrees; the last two beyond prf / 2 together with their band
TAPER = ("taylor", 6, 50.0)


def cosine(f: float) -> float:
    return float(np.sqrt(1 - (WAVELENGTH * f / (2 * VELOCITY)) ** 2))


def geometry_of(slant_range: NDArray[np.float64], doppler_centroid: float = 0.0, bandwidth: float = 500.0) -> sarfocus.StripmapGeometry:
    return sarfocus.StripmapGeometry(
        **COLLECTION, slant_range=slant_range, doppler_bandwidth=bandwidth, doppler_centroid=doppler_centroid
    )


def zero_doppler(beam_centre: float, closest: float, doppler_centroid: float) -> float:
    """Give the pulse of closest approach: sin(squint) = lambda fdc / 2v, along track -R tan(squint) before the beam centre."""
    return beam_centre + PRF * WAVELENGTH * closest * doppler_centroid / (2 * VELOCITY**2 * cosine(doppler_centroid))


def point_echo(
    n_pulse: int, n_range: int, targets: list[tuple[float, float, complex]], doppler_centroid: float = 0.0, **options: object
) -> NDArray[np.complex64]:
    """Echo of points (beam centre, sample of closest range, reflectivity), seen over more than the band that is processed."""
    pixels = [(zero_doppler(i, START + SPACING * j, doppler_centroid), j) for i, j, _ in targets]
    recorded = geometry_of(START + SPACING * np.arange(n_range), doppler_centroid, 620.0)
    return simulate.stripmap_echo(
        recorded, pixels, [a for *_, a in targets], n_azimuth=n_pulse, range_bandwidth=BAND, **options  # type: ignore[arg-type]
    )


def response(image: NDArray[np.complex64], place: tuple[float, float], doppler_centroid: float) -> quality.PointResponse:
    """The range band of the image lies (1 / D(fdc) - 1) c / wavelength above zero."""
    range_centre = (1 / cosine(doppler_centroid) - 1) * C / WAVELENGTH / SAMPLING
    return quality.point_response(
        image, place, oversampling=(PRF / 500.0, SAMPLING / BAND), band_centre=(doppler_centroid / PRF, range_centre)
    )


def turned_back(phase: float, reflectivity: complex, closest: float) -> float:
    """What is left of a peak's phase after the reflectivity's, the range's and the -pi/4 of stationary phase."""
    expected = reflectivity * np.exp(-4j * np.pi * closest / WAVELENGTH - 0.25j * np.pi)
    return float(np.angle(np.exp(1j * phase) / expected))


@pytest.mark.parametrize(("n_pulse", "n_range"), [(1500, 90), (1401, 91)])
@pytest.mark.parametrize("doppler_centroid", SQUINTS)
def test_agrees_with_the_exact_sum(n_pulse: int, n_range: int, doppler_centroid: float) -> None:
    """Off the samples, with several samples of migration."""
    rng = np.random.default_rng(3)
    targets = [(700 + 40 * x, n_range / 2 + 4 * y, complex(a, b)) for x, y, a, b in rng.normal(size=(6, 4))]
    echo = point_echo(n_pulse, n_range, targets, doppler_centroid, window=TAPER)
    slant_range = START + SPACING * np.linspace(20.3, n_range - 30.1, 37)
    image = sarfocus.form_stripmap(echo, geometry_of(slant_range, doppler_centroid), **FAST_TIME)
    fields = {"doppler_bandwidth": 500.0, "doppler_centroid": doppler_centroid, "padding": 200}
    expected = oracle.image(echo, **COLLECTION, **FAST_TIME, **fields, slant_range=slant_range)
    # The kernel: -84 dB for the worst component, -90 dB on average; secondary range compression between two references less than that.
    assert np.linalg.norm(image - expected) < 10 ** (-80 / 20) * np.linalg.norm(expected)
    edge = abs(doppler_centroid) + 250.0
    assert slant_range[0] * (1 / cosine(edge) - 1) > 2 * SPACING


def test_secondary_range_compression_holds_over_a_swath_that_needs_many_references() -> None:
    """L band, 20 degrees, a tenth of the carrier as bandwidth: 30 rad of it at the edges, which vary by 4 over the gates."""
    wavelength, prf, velocity, sampling, start = 0.24, 700.0, 100.0, 120e6, 2000.0
    spacing = C / (2 * sampling)
    strip = {"wavelength": wavelength, "prf": prf, "velocity": velocity, "doppler_centroid": 0.0}
    recorded = sarfocus.StripmapGeometry(**strip, slant_range=start + spacing * np.arange(500), doppler_bandwidth=580.0)
    targets = [(n, g) for n, g in zip((1900.0, 2000.4, 2100.0), (30.2, 130.5, 230.7), strict=True)]
    echo = simulate.stripmap_echo(recorded, targets, np.ones(3), n_azimuth=6000, range_bandwidth=100e6, window=TAPER)
    gates = start + spacing * np.r_[28:33, 128:134, 228:234]
    image = sarfocus.form_stripmap(
        echo,
        sarfocus.StripmapGeometry(**strip, slant_range=gates, doppler_bandwidth=560.0),
        range_start=start,
        range_sampling=sampling,
    )
    expected = oracle.image(
        echo, **strip, slant_range=gates, doppler_bandwidth=560.0, range_start=start, range_sampling=sampling, padding=200
    )
    # Linear between references 0.1 rad apart: 0.1^2 / 8 = -58 dB at the very edge of both bands, a tenth of that over all.
    assert np.linalg.norm(image - expected) < 10 ** (-65 / 20) * np.linalg.norm(expected)


@pytest.mark.parametrize("doppler_centroid", SQUINTS)
def test_points_are_those_of_backprojection(doppler_centroid: float) -> None:
    n_pulse, n_range = 4096, 140
    reflectivity = 1.5 * np.exp(0.7j)
    beam_centre, sample = 2050.3, 70.37
    closest = START + SPACING * sample
    echo = point_echo(n_pulse, n_range, [(beam_centre, sample, reflectivity)], doppler_centroid)
    slant_range = START + SPACING * (0.31 + np.arange(20, 120))
    image = sarfocus.form_stripmap(echo, geometry_of(slant_range, doppler_centroid), **FAST_TIME)

    pulses = np.arange(n_pulse)
    along = VELOCITY / PRF * zero_doppler(pulses[:, None], slant_range[None], doppler_centroid)
    pixels = np.stack([along, np.broadcast_to(slant_range, along.shape), np.zeros_like(along)], axis=-1)
    track = np.stack([VELOCITY / PRF * pulses, 0 * pulses, 0 * pulses], axis=1)
    sums = sarfocus.backproject(
        echo, track, sarfocus.ImageGrid.from_points(pixels), range_start=START, range_spacing=SPACING, wavelength=WAVELENGTH
    )
    # Backprojection takes the carrier phase of the pixel's range off and knows no Doppler band: put the one on, cut to the other.
    spectrum = np.fft.fft(sums * np.exp(-4j * np.pi * slant_range / WAVELENGTH), axis=0)
    f = np.fft.fftfreq(n_pulse, 1 / PRF)
    f -= PRF * np.floor((f - doppler_centroid) / PRF + 0.5) + doppler_centroid
    spectrum[(f < -250.0) | (f >= 250.0)] = 0
    backprojected = np.fft.ifft(spectrum, axis=0).astype(np.complex64)

    place = (beam_centre, (closest - slant_range[0]) / SPACING)
    ours = response(image, place, doppler_centroid)
    theirs = response(backprojected, place, doppler_centroid)
    for point in (ours, theirs):
        # The 1/32 grid's parabola and the Fresnel ripple of the spectra (they differ): 1e-3 samples.
        assert point.position == pytest.approx(place, abs=2e-3)
    for axis in ("azimuth", "range"):
        one, other = getattr(ours, axis), getattr(theirs, axis)
        assert one.irw_cells == pytest.approx(other.irw_cells, rel=2e-3)
        assert one.pslr_db == pytest.approx(other.pslr_db, abs=0.05)
        assert one.islr_db == pytest.approx(other.islr_db, abs=0.05)
    # The sum over pulses has no -pi/4 of a spectrum. 2e-3 rad: ripple again.
    assert abs(turned_back(ours.phase, reflectivity, closest)) < 2e-3
    assert abs(turned_back(theirs.phase - np.pi / 4, reflectivity, closest)) < 2e-3
    rate = 2 * VELOCITY**2 / (WAVELENGTH * closest)
    assert ours.amplitude == pytest.approx(1.5 * 500.0 / np.sqrt(rate * cosine(doppler_centroid) ** 3), rel=2e-3)
    near = slice(round(beam_centre) - 64, round(beam_centre) + 64)
    scale = ours.amplitude / theirs.amplitude * np.exp(-0.25j * np.pi)
    # Spectra with different ripple at the edges of the aperture, 30 % beyond those of the band.
    assert np.abs(image[near] - scale * backprojected[near]).max() < 3e-3 * np.abs(image).max()


@pytest.mark.parametrize("doppler_centroid", SQUINTS)
def test_raw_echoes_focus_at_their_place_with_their_phase(doppler_centroid: float) -> None:
    """Pulses as sent, delayed by the hyperbola: nothing of the library's simulator in it."""
    n_pulse, n_fast_time, duration = 3000, 400, 1.0e-6
    beam_centre, sample, reflectivity = 1490.25, 110.6, 0.8 * np.exp(-2.0j)
    closest = START + SPACING * sample
    t = (np.arange(n_pulse) - zero_doppler(beam_centre, closest, doppler_centroid)) / PRF
    distance = np.hypot(closest, VELOCITY * t)
    doppler = -2 * VELOCITY**2 * t / (WAVELENGTH * distance)
    seen = np.abs(doppler - doppler_centroid) < 310.0
    late = 2 * (START + SPACING * np.arange(n_fast_time) - distance[:, None]) / C - duration / 2  # after the middle of the pulse
    pulse = np.where(np.abs(late) < duration / 2, np.exp(1j * np.pi * BAND / duration * late**2), 0)
    echo = (reflectivity * (seen * np.exp(-4j * np.pi * distance / WAVELENGTH))[:, None] * pulse).astype(np.complex64)
    replica = sarfocus.signal.chirp(bandwidth=BAND, duration=duration, sampling_rate=SAMPLING)
    slant_range = START + SPACING * (60.0 + np.arange(100))
    # Timed from the leading edge of the pulse: half a sample before the first sample of the replica.
    image = sarfocus.form_stripmap(echo, geometry_of(slant_range, doppler_centroid), replica, **FAST_TIME, replica_origin=0.0)
    compressed = sarfocus.range_compress(echo, replica)
    assert np.array_equal(image, sarfocus.form_stripmap(compressed, geometry_of(slant_range, doppler_centroid), **FAST_TIME))
    place = (beam_centre, sample - 60.0)
    point = response(image, place, doppler_centroid)
    assert point.position[0] == pytest.approx(place[0], abs=2e-3)
    # The first sample of the replica stands for half a sample after the edge; 1 of 180 samples comes and goes at the ends of the pulse.
    assert point.position[1] == pytest.approx(place[1] - 0.5, abs=0.02) or point.position[1] == pytest.approx(place[1], abs=0.02)
    assert abs(turned_back(point.phase, reflectivity, closest)) < 0.05
