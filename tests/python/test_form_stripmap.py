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
    return sarfocus.StripmapGeometry(**COLLECTION, slant_range=slant_range, doppler_bandwidth=bandwidth, doppler_centroid=doppler_centroid)


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
        recorded,
        pixels,
        [a for *_, a in targets],
        n_azimuth=n_pulse,
        range_bandwidth=BAND,
        **options,  # type: ignore[arg-type]
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
    late = 2 * (START + SPACING * np.arange(n_fast_time) - distance[:, None]) / C  # after the middle of the pulse
    pulse = np.where(np.abs(late) < duration / 2, np.exp(1j * np.pi * BAND / duration * late**2), 0)
    echo = (reflectivity * (seen * np.exp(-4j * np.pi * distance / WAVELENGTH))[:, None] * pulse).astype(np.complex64)
    replica = sarfocus.signal.chirp(bandwidth=BAND, duration=duration, sampling_rate=SAMPLING)
    slant_range = START + SPACING * (60.0 + np.arange(100))
    timing = {"replica_origin": (len(replica) - 1) / 2}
    image = sarfocus.form_stripmap(echo, geometry_of(slant_range, doppler_centroid), replica, **FAST_TIME, **timing)
    compressed = sarfocus.range_compress(echo, replica, **timing)
    assert np.array_equal(image, sarfocus.form_stripmap(compressed, geometry_of(slant_range, doppler_centroid), **FAST_TIME))
    place = (beam_centre, sample - 60.0)
    point = response(image, place, doppler_centroid)
    # One of the 180 samples of the pulse comes and goes at its ends.
    assert point.position == pytest.approx(place, abs=0.02)
    assert abs(turned_back(point.phase, reflectivity, closest)) < 0.05


@pytest.mark.parametrize("doppler_centroid", SQUINTS)
def test_decompressed_a_point_is_the_parabolic_chirp_of_its_beam_centre(doppler_centroid: float) -> None:
    """What autofocus takes for granted: exp(-j pi K (t - tc)^2 + 2j pi fdc (t - tc)) in the gate of the closest range."""
    beam_centre, reflectivity = 2050.3, 1.5 * np.exp(0.7j)
    slant_range = START + SPACING * np.arange(20, 100)
    geometry = geometry_of(slant_range, doppler_centroid)
    echo = point_echo(4096, 120, [(beam_centre, 60, reflectivity)], doppler_centroid)
    raw = sarfocus.azimuth_decompress(sarfocus.form_stripmap(echo, geometry, **FAST_TIME), geometry)
    closest = slant_range[40]
    peak = reflectivity * np.exp(-4j * np.pi * closest / WAVELENGTH - 0.25j * np.pi)
    peak *= 500.0 / np.sqrt(geometry.fm_rate(40) * cosine(doppler_centroid) ** 3)
    expected = simulate.stripmap(geometry, [(beam_centre, 40)], [peak], n_azimuth=4096)
    # The amplitude over the band: Fresnel ripple of 20 % more aperture than processed, 2e-3 to 5e-3 in all, and D^-1.5, 0.2 %.
    assert np.linalg.norm(raw[:, 40] - expected[:, 40]) < 8e-3 * np.linalg.norm(expected[:, 40])


def mismatch(doppler_centroid: float, closest: float, velocity: float) -> float:
    """Give the pulses by which a frequency of the band is at most seen elsewhere along the hyperbola than along the parabola."""
    f = np.linspace(doppler_centroid - 250.0, doppler_centroid + 250.0, 201)
    d = np.sqrt(1 - (WAVELENGTH * f / (2 * VELOCITY)) ** 2)
    seconds = WAVELENGTH * closest / 2
    hyperbola = -seconds / VELOCITY**2 * (f / d - doppler_centroid / cosine(doppler_centroid))
    return float(PRF * np.abs(hyperbola + seconds / velocity**2 * (f - doppler_centroid)).max())


@pytest.mark.parametrize(
    ("doppler_centroid", "pulses_off", "loss", "sidelobe_db"), [(0.0, 0.37, 0.02, 0.1), (-150.0, 1.1, 0.025, 0.2), (400.0, 2.2, 0.06, 0.7)]
)
def test_a_phase_error_of_the_pulses_comes_off_the_decompressed_image(
    doppler_centroid: float, pulses_off: float, loss: float, sidelobe_db: float
) -> None:
    """On the image as far as the header says; on the echo, which is then formed again, to the bit of single precision."""
    n_pulse, beam_centre, sample, reflectivity = 4096, 2050.3, 60.37, 1.5 * np.exp(0.7j)
    closest = START + SPACING * sample
    # 6 rad, a third of an aperture long: smears the point over dozens of pixels.
    phase = 6 * np.sin(2 * np.pi * np.arange(n_pulse) / 480 + 0.3)
    targets = [(beam_centre, sample, reflectivity)]
    echo = point_echo(n_pulse, 120, targets, doppler_centroid, phase_error=phase)
    slant_range = START + SPACING * (0.31 + np.arange(20, 100))
    place = (beam_centre, (closest - slant_range[0]) / SPACING)
    geometry = geometry_of(slant_range, doppler_centroid)
    ideal = sarfocus.form_stripmap(point_echo(n_pulse, 120, targets, doppler_centroid), geometry, **FAST_TIME)
    blurred = sarfocus.form_stripmap(echo, geometry, **FAST_TIME)
    assert np.abs(blurred).max() < 0.5 * np.abs(ideal).max()

    velocity = VELOCITY * cosine(doppler_centroid) ** 1.5  # the rate of the parabola is that of the hyperbola at the centroid
    assert mismatch(doppler_centroid, closest, velocity) < pulses_off
    fields = {**COLLECTION, "velocity": velocity, "doppler_bandwidth": 500.0, "doppler_centroid": doppler_centroid}
    parabola = sarfocus.StripmapGeometry(**fields, slant_range=slant_range)
    correction = np.exp(-1j * phase).astype(np.complex64)[:, None]
    image = sarfocus.azimuth_compress(sarfocus.azimuth_decompress(blurred, parabola) * correction, parabola)
    point, best = response(image, place, doppler_centroid), response(ideal, place, doppler_centroid)
    # The error turns by 0.079 rad a pulse: 8 Hz, for which migration is off by up to 0.16 samples (0.43 with most squint), and 0.03,
    # 0.08, 0.17 rad remain where the pulses are off most.
    assert point.amplitude > (1 - loss) * best.amplitude
    assert point.position == pytest.approx(place, abs=0.03)
    assert point.azimuth.pslr_db == pytest.approx(best.azimuth.pslr_db, abs=sidelobe_db)
    assert abs(turned_back(point.phase, reflectivity, closest)) < 0.1

    again = sarfocus.form_stripmap(echo * correction, geometry, **FAST_TIME)
    assert np.abs(again - ideal).max() < 2e-6 * np.abs(ideal).max()  # an echo rounded twice more


def test_the_doppler_centroid_of_speckle_is_found_but_for_the_prf() -> None:
    slant_range = START + SPACING * np.arange(64)
    geometry = geometry_of(slant_range, 2 * PRF + 170.0)
    strip = simulate.stripmap(geometry, np.zeros((0, 2)), [], n_azimuth=4096, clutter_power=1.0, seed=5)
    # 200000 independent samples: 0.9 Hz from seed to seed.
    assert sarfocus.estimate_doppler_centroid(strip, PRF) == pytest.approx(170.0, abs=4.0)
    assert sarfocus.estimate_doppler_centroid(strip.conj(), PRF) == pytest.approx(-170.0, abs=4.0)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_bits_depend_on_neither_threads_nor_strides(threads: int) -> None:
    rng = np.random.default_rng(1)
    echo = rng.normal(size=(301, 160)).astype(np.float32).view(np.complex64)
    geometry = geometry_of(START + SPACING * np.linspace(3, 70, 50), 400.0)
    reference = sarfocus.form_stripmap(echo, geometry, **FAST_TIME, threads=1)
    wide = np.full((301, 240), np.nan, np.complex64)
    wide[:, 1::3] = echo
    out = np.zeros((100, 602), np.complex64)
    for source in (echo, np.asfortranarray(echo), wide[:, 1::3], np.ascontiguousarray(echo[::-1, ::-1])[::-1, ::-1]):
        target = out.T[::-2, ::2]
        assert sarfocus.form_stripmap(source, geometry, **FAST_TIME, threads=threads, out=target) is target
        assert np.array_equal(target, reference)
    assert not out[1::2].any()


def test_refusals_name_the_argument() -> None:
    echo = np.ones((64, 40), np.complex64)
    geometry = geometry_of(START + SPACING * np.arange(20))
    with pytest.raises(TypeError, match="echo: expected a NumPy array of dtype complex64"):
        sarfocus.form_stripmap(echo.astype(np.complex128), geometry, **FAST_TIME)  # type: ignore[arg-type]
    with pytest.raises(sarfocus.ShapeError, match="out"):
        sarfocus.form_stripmap(echo, geometry, **FAST_TIME, out=np.empty((64, 40), np.complex64))
    with pytest.raises(ValueError, match="overlap"):
        sarfocus.form_stripmap(echo, geometry, **FAST_TIME, out=echo[:, :20])
    with pytest.raises(ValueError, match="range_sampling"):
        sarfocus.form_stripmap(echo, geometry, range_start=START, range_sampling=0.0)
    with pytest.raises(ValueError, match="chirp: expected the pulse as sent"):
        sarfocus.form_stripmap(echo, geometry, **FAST_TIME, window="hamming")
    with pytest.raises(sarfocus.ShapeError, match="chirp"):
        sarfocus.form_stripmap(echo, geometry, np.empty(0, np.complex64), **FAST_TIME)
    with pytest.raises(ValueError, match=r"doppler_centroid: expected .* below 2 velocity / wavelength.* got 8250 Hz"):
        sarfocus.form_stripmap(echo, geometry_of(START + SPACING * np.arange(20), -8000.0), **FAST_TIME)
    with pytest.raises(ValueError, match=r"slant_range\[19\]: expected a range that was recorded"):
        sarfocus.form_stripmap(echo[:, :19], geometry, **FAST_TIME)
    with pytest.raises(ValueError, match=r"slant_range\[1\]: expected ascending"):
        sarfocus.form_stripmap(echo, geometry_of(START + SPACING * np.arange(20)[::-1]), **FAST_TIME)
    with pytest.raises(sarfocus.Cancelled):
        sarfocus.form_stripmap(echo, geometry, **FAST_TIME, progress=lambda *_: False)
    echo[31, 7] = np.nan
    for chirp in (None, np.ones(4, np.complex64)):
        with pytest.raises(sarfocus.NumericalError, match=r"echo: expected finite samples, got nan.* at \[31, 7\]"):
            sarfocus.form_stripmap(echo, geometry, chirp, **FAST_TIME)
    with pytest.raises(sarfocus.NumericalError, match=r"data: .* at \[31, 7\]"):
        sarfocus.estimate_doppler_centroid(echo, PRF)
