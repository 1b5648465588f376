"""hrws.Echo, hrws.reconstruct and simulate.hrws against the equations."""

from typing import Any

import numpy as np
import pytest

import sarfocus
from reference import echoes
from reference import hrws as oracle
from sarfocus import ImageGrid, backproject, hrws, simulate
from sarfocus.experiments import zhou2022

WAVELENGTH, SPACING, BANDWIDTH = 0.031, 0.5, 250e6
PRF, VELOCITY = 60.0, 40.0
SIGNAL = 120.0  # Hz, illuminated
N_PULSE, N_RANGE = 161, 90
STEP = VELOCITY / PRF
UNEVEN = (0.0, 0.35, 0.7)
EVEN = tuple(2.0 * STEP * n / 3.0 for n in range(3))
TARGET = np.array([0.1, 1200.0, 0.0])
START = 1480.0


def platform() -> np.ndarray:
    return np.stack([(np.arange(N_PULSE) - N_PULSE // 2) * STEP, np.zeros(N_PULSE), np.full(N_PULSE, 900.0)], axis=1)


def echo(along: tuple[float, ...] = UNEVEN, target: Any = TARGET, **options: Any) -> hrws.Echo:
    given: dict[str, Any] = {"model": "equivalent", "doppler_bandwidth": SIGNAL} | options
    return simulate.hrws(
        platform(),
        [[x, 0.0, 0.0] for x in along],
        [target],
        [1.0],
        n_range=N_RANGE,
        range_start=START,
        range_spacing=SPACING,
        wavelength=WAVELENGTH,
        bandwidth=BANDWIDTH,
        prf=PRF,
        **given,
    )


def grid(shape: tuple[int, int] = (40, 9), along: float = 0.0) -> ImageGrid:
    return ImageGrid.plane((along - 4.0, 1197.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.7, 0.0), shape)


def error_db(value: np.ndarray, truth: np.ndarray) -> float:
    return float(10 * np.log10(np.sum(np.abs(value - truth) ** 2) / np.sum(np.abs(truth) ** 2)))


@pytest.mark.parametrize("model", ["bistatic", "equivalent"])
def test_echoes_of_every_channel_are_those_of_its_antennas(model):
    rng = np.random.default_rng(3)
    motion = 0.05 * rng.standard_normal((N_PULSE, 3))
    imbalance = np.array([1.0, 0.8j, 0.5 - 0.2j])
    made = echo(model=model, motion=motion, imbalance=imbalance, transmitter=1)
    tx = platform() + motion + np.array([UNEVEN[1], 0, 0])
    middle = np.array([0.5 * (np.mean(UNEVEN) + UNEVEN[1]), 0, 0])
    seen = oracle.visible(platform(), middle, TARGET, prf=PRF, wavelength=WAVELENGTH, bandwidth=SIGNAL)
    assert 40 < seen.sum() < 150
    r = START + SPACING * np.arange(N_RANGE) + np.zeros((N_PULSE, 1))
    for n, x in enumerate(UNEVEN):
        rx = platform() + motion + np.array([x, 0, 0])
        centre = 0.5 * (tx + rx)
        distance = echoes.ranges(tx, rx, TARGET[None]) if model == "bistatic" else echoes.ranges(centre, centre, TARGET[None])
        expected = imbalance[n] * seen[:, None] * echoes.point_echoes(distance, np.ones(1), r, WAVELENGTH, BANDWIDTH)
        assert np.abs(made.data[n] - expected).max() < 3e-7  # single precision of values up to 1
        np.testing.assert_allclose(made.phase_centres[n], centre - motion, rtol=0, atol=1e-12)
    assert (made.baselines is None) == (model == "equivalent")


def test_noise_is_white_over_channels_and_of_the_power_stated():
    still = echo()
    noisy = echo(noise_power=0.25, seed=5)
    noise = noisy.data - still.data
    assert np.mean(np.abs(noise) ** 2) == pytest.approx(0.25, rel=0.03)  # 43470 samples: 0.5 %
    assert abs(np.vdot(noise[0], noise[1])) < 5 * 0.25 * np.sqrt(noise[0].size)
    np.testing.assert_array_equal(noisy.data, echo(noise_power=0.25, seed=5, threads=1).data)


def test_yen_weights_solve_the_equations():
    found = hrws.channel_weights(echo(), interpolation="yen")
    offsets = np.array(UNEVEN) / 2
    expected = [oracle.yen_weights(f, offsets, PRF, VELOCITY) for f in found.frequency]
    np.testing.assert_allclose(found.weights, expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(hrws.sampling(echo()).offsets, offsets - offsets.mean(), atol=1e-9)


def test_weights_become_those_of_yen_without_noise():
    yen = hrws.channel_weights(echo(), interpolation="yen")
    least_squares = hrws.channel_weights(echo(), noise=1e-12)
    np.testing.assert_allclose(least_squares.weights, yen.weights, atol=1e-8)
    assert least_squares.condition_number == pytest.approx(yen.condition_number)


def folded_by_hand(made: hrws.Echo, points: np.ndarray, interpolation: str, bandwidth: float) -> np.ndarray:
    """Weights by the local Doppler frequency on the terms of an exact point, no interpolation of samples."""
    middle = np.array([0.5 * np.mean(UNEVEN), 0, 0])
    seen = oracle.visible(platform(), middle, TARGET, prf=PRF, wavelength=WAVELENGTH, bandwidth=SIGNAL)
    table = hrws.channel_weights(made, interpolation=interpolation, doppler_bandwidth=bandwidth)
    step = table.frequency[1] - table.frequency[0]
    total = np.zeros(len(points), complex)
    for n in range(len(UNEVEN)):
        centres = made.phase_centres[n]
        f = oracle.local_doppler(centres, points, np.array([1.0, 0, 0]), wavelength=WAVELENGTH, velocity=VELOCITY)
        inside = (f >= table.frequency[0] - 0.5 * step) & (f < table.frequency[-1] + 0.5 * step)
        weight = inside * np.interp(f, table.frequency, table.weights[:, n])
        terms = oracle.point_terms(centres, TARGET, points, wavelength=WAVELENGTH, bandwidth=BANDWIDTH)
        total += (seen[:, None] * weight * terms).sum(axis=0)
    return total


@pytest.mark.parametrize("interpolation", ["mmse", "yen"])
@pytest.mark.parametrize("bandwidth", [0.0, SIGNAL])
def test_folded_is_the_weighted_sum(interpolation, bandwidth):
    made = echo()
    image = hrws.reconstruct(made, grid(), interpolation=interpolation, doppler_bandwidth=bandwidth)
    truth = folded_by_hand(made, grid().positions().reshape(-1, 3), interpolation, bandwidth).reshape(image.shape)
    # -75 dB of the range interpolation; frequencies at the border of two entries may fall on either side, one pulse in 161 where they jump.
    assert error_db(image, truth) < -50.0


def test_even_channels_give_plain_backprojection():
    made = echo(EVEN)
    where = {"range_start": START, "range_spacing": SPACING, "wavelength": WAVELENGTH}
    plain = sum(backproject(made.data[n], made.phase_centres[n], grid(), **where) for n in range(3))
    assert error_db(hrws.reconstruct(made, grid(), interpolation="yen"), plain) < -100.0  # all frequencies are within the band
    assert hrws.channel_weights(made).condition_number == pytest.approx(1.0)


def even_image(points: ImageGrid) -> np.ndarray:
    return hrws.reconstruct(echo(EVEN), points, doppler_bandwidth=SIGNAL)


@pytest.mark.parametrize("reconstruction", ["folded", "sub_image"])
def test_a_point_looks_as_if_sampled_evenly(reconstruction):
    """The illumination ends within one pulse: there the two samplings differ by about one term of some 200, spread over the image."""
    options: dict[str, Any] = {"doppler_bandwidth": SIGNAL, "reconstruction": reconstruction}
    image = hrws.reconstruct(echo(), grid(), **options)
    # The middle of the channels lies elsewhere on the track; amplitudes do not depend on it.
    assert error_db(np.abs(image), np.abs(even_image(grid()))) < -38.0


@pytest.mark.parametrize("reconstruction", ["folded", "sub_image"])
@pytest.mark.parametrize("interpolation", ["mmse", "yen"])
def test_a_band_far_from_zero_doppler_is_processed_where_it_is(reconstruction, interpolation):
    ahead = TARGET + np.array([58.0, 0, 0])  # 100 Hz at the middle of the track
    options: dict[str, Any] = {"doppler_bandwidth": SIGNAL, "doppler_centroid": 100.0}
    points = grid(along=58.0)
    # About the same middle: so the same pulses illuminate the point.
    centred = tuple(x + (np.mean(EVEN) - np.mean(UNEVEN)) / 2 for x in UNEVEN)
    uneven, even = echo(centred, ahead, doppler_centroid=100.0), echo(EVEN, ahead, doppler_centroid=100.0)
    image = hrws.reconstruct(uneven, points, reconstruction=reconstruction, interpolation=interpolation, **options)
    expected = np.abs(hrws.reconstruct(even, points, **options))
    assert expected.max() > 220.0  # of 3 channels and 105 pulses; the peak lies between pixels
    # The ends of the illumination, as in the test before; yen's weights jump within the signal, and its series is cut off.
    assert error_db(np.abs(image), expected) < (-38.0 if interpolation == "mmse" else -30.0)
    elsewhere = hrws.reconstruct(uneven, points, reconstruction=reconstruction, doppler_bandwidth=SIGNAL)
    assert np.abs(elsewhere).max() < 0.7 * expected.max()  # the half of the band beyond 60 Hz is not there


def ambiguity_level(made: hrws.Echo, **options: Any) -> float:
    """Highest pixel about the first ambiguity, PRF lambda R / (2 v) along the track, over the target's, dB."""
    offset = PRF * WAVELENGTH * 1500.0 / (2 * VELOCITY)
    target = np.abs(hrws.reconstruct(made, grid(), doppler_bandwidth=SIGNAL, **options)).max()
    ambiguity = np.abs(hrws.reconstruct(made, grid(along=offset), doppler_bandwidth=SIGNAL, **options)).max()
    return float(20 * np.log10(ambiguity / target))


def test_imbalance_brings_back_ambiguities_where_and_as_high_as_it_should():
    clean = ambiguity_level(echo())
    imbalance = np.array([1.0, 1.4 * np.exp(0.8j), 1.0])
    found = ambiguity_level(echo(imbalance=imbalance))
    # What the weights leave of the band one prf away, over what they leave of the band itself, in the middle of the overlap of both.
    weights = hrws.channel_weights(echo(), doppler_bandwidth=SIGNAL)
    at = np.argmin(np.abs(weights.frequency - PRF / 2))
    turn = np.exp(-2j * np.pi * PRF * np.array(UNEVEN) / 2 / VELOCITY)
    leak = abs(weights.weights[at] @ (imbalance * turn)) / abs(weights.weights[at] @ imbalance)
    overlap = (SIGNAL - PRF) / SIGNAL  # of the illumination, seen by both
    expected = 20 * np.log10(leak * overlap)
    assert clean < found - 15.0
    # The ambiguity is defocused (its range history is another's), the weights vary along the overlap: 3 dB.
    assert found == pytest.approx(expected, abs=3.0)


def test_sub_image_is_the_sum_of_the_paper():
    made = echo()
    about = grid().subgrid((17, 3), (7, 3))
    points = about.positions().reshape(-1, 3)
    half = 4
    image = hrws.reconstruct(made, about, reconstruction="sub_image", interpolation="yen", half_width=half)
    offsets = np.array(UNEVEN) / 2 - np.mean(UNEVEN) / 2
    even = (np.arange(3) - 1) / 3 * STEP
    line = platform() + np.array([np.mean(UNEVEN) / 2, 0, 0])
    axis = np.array([1.0, 0, 0])
    seen = oracle.visible(platform(), np.array([np.mean(UNEVEN) / 2, 0, 0]), TARGET, prf=PRF, wavelength=WAVELENGTH, bandwidth=SIGNAL)
    terms = seen[:, None] * oracle.point_terms(
        line + offsets[:, None, None] * axis, TARGET, points, wavelength=WAVELENGTH, bandwidth=BANDWIDTH
    )
    t, times = np.arange(-half, half + 1), offsets / STEP
    psi = np.empty((3, 2 * half + 1, 3), complex)
    for i in range(3):  # [Yen1956]: product of sines over the distance, alternating where the number of channels is even
        for n in range(3):
            x = even[i] / STEP - times[n] - t
            others = [m for m in range(3) if m != n]
            factor = np.prod(np.sin(np.pi * (even[i] / STEP - times[others])) / np.sin(np.pi * (times[n] - times[others])))
            psi[i, :, n] = np.sinc(x) * factor
    ideal = oracle.ranges(line + offsets[:, None, None] * axis, points)
    evenly = oracle.ranges(line + even[:, None, None] * axis, points)
    truth = oracle.sub_image(terms, psi, ideal, evenly, wavelength=WAVELENGTH).reshape(image.shape)
    assert error_db(image, truth) < -65.0  # -75 dB of the range interpolation


def test_motion_is_added_to_the_centres_of_all_channels():
    rng = np.random.default_rng(8)
    motion = 0.01 * rng.standard_normal((N_PULSE, 3)) * (0, 1, 1)
    made = echo(motion=motion)
    told = hrws.Echo(made.data, made.phase_centres + motion, START, SPACING, WAVELENGTH, PRF, VELOCITY)
    for way in ("folded", "sub_image"):
        options: dict[str, Any] = {"doppler_bandwidth": SIGNAL, "reconstruction": way}
        image = hrws.reconstruct(made, grid(), motion, **options)
        # The line through the centres told is turned by 2e-5: frequencies by 0.05 Hz, of 1.15 Hz from pulse to pulse, where weights jump;
        # the even samples of `sub_image` lie elsewhere.
        assert error_db(image, hrws.reconstruct(told, grid(), **options)) < (-45.0 if way == "folded" else -30.0)
        assert error_db(image, hrws.reconstruct(echo(), grid(), **options)) < -40.0


def test_moved_takes_the_motion_into_the_echo():
    pulse = np.linspace(-1.0, 1.0, N_PULSE)
    motion = 0.05 * np.random.default_rng(4).standard_normal((N_PULSE, 3))
    motion -= np.polynomial.polynomial.polyval(pulse, np.polynomial.polynomial.polyfit(pulse, motion, 1)).T  # the track is not turned
    made = echo(model="bistatic", motion=motion, transmitter=1)
    follow = hrws.moved(made, motion)
    assert np.shares_memory(follow.data, made.data)
    np.testing.assert_array_equal(np.asarray(follow.baselines), np.asarray(made.baselines))
    np.testing.assert_array_equal(hrws.reconstruct(follow, grid()), hrws.reconstruct(made, grid(), motion))
    with pytest.raises(sarfocus.ShapeError, match="motion"):
        hrws.moved(made, motion[1:])
    with pytest.raises(sarfocus.NumericalError):
        hrws.moved(made, np.full((N_PULSE, 3), np.nan))


def test_baselines_account_for_the_two_legs():
    wide = (0.0, 12.35, 24.7)  # 2.6 cm of extra path at 1.5 km
    with_legs = echo(wide, model="bistatic")
    without = hrws.Echo(with_legs.data, with_legs.phase_centres, START, SPACING, WAVELENGTH, PRF, VELOCITY)
    truth = hrws.reconstruct(echo(wide), grid(), doppler_bandwidth=SIGNAL)
    assert error_db(hrws.reconstruct(with_legs, grid(), doppler_bandwidth=SIGNAL), truth) < -30.0
    assert error_db(hrws.reconstruct(without, grid(), doppler_bandwidth=SIGNAL), truth) > -12.0


@pytest.mark.parametrize("reconstruction", ["folded", "sub_image"])
def test_same_bits_for_any_strides_and_threads(reconstruction):
    made = echo()
    memory = np.zeros((3, 2 * N_RANGE, N_PULSE), np.complex64)
    view = memory.transpose(0, 2, 1)[:, ::-1, ::2]
    view[...] = made.data
    centres = np.asfortranarray(made.phase_centres)
    strided = hrws.Echo(view, centres, START, SPACING, WAVELENGTH, PRF, made.velocity)
    options: dict[str, Any] = {"doppler_bandwidth": SIGNAL, "reconstruction": reconstruction}
    expected = hrws.reconstruct(made, grid(), threads=1, **options)
    out = np.zeros((9, 40), np.complex64).T
    assert hrws.reconstruct(strided, grid(), threads=3, out=out, **options) is out
    np.testing.assert_array_equal(out, expected)


REFUSALS: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"data": np.zeros((2, N_PULSE, N_RANGE), np.complex64)}, sarfocus.ShapeError, r"phase_centres: expected \(2, 161, 3\)"),
    ({"data": np.zeros((N_PULSE, N_RANGE), np.complex64)}, sarfocus.ShapeError, "data: expected 3 dimensions"),
    ({"data": np.zeros((3, N_PULSE, N_RANGE))}, TypeError, "data: expected a NumPy array of dtype complex64"),
    ({"data": np.zeros((3, N_PULSE, N_RANGE), np.complex64)}, ValueError, r"data\[0\]: expected samples; leave a missing channel out"),
    ({"prf": 0.0}, ValueError, "prf"),
    ({"velocity": 50.0}, ValueError, "velocity: expected that of the phase centres, (40|39.9)"),
    ({"range_start": np.zeros(3)}, sarfocus.ShapeError, "range_start"),
    ({"baselines": np.zeros((2, 3))}, sarfocus.ShapeError, r"baselines: expected \(3, 3\)"),
]


@pytest.mark.parametrize(("changes", "error", "message"), REFUSALS)
def test_refusals_name_argument_expected_and_actual(changes, error, message):
    made = echo()
    arguments = {
        "data": made.data,
        "phase_centres": made.phase_centres,
        "range_start": START,
        "range_spacing": SPACING,
        "wavelength": WAVELENGTH,
        "prf": PRF,
        "velocity": VELOCITY,
    }
    with pytest.raises(error, match=message):
        hrws.Echo(**(arguments | changes))


def test_nan_is_refused_with_its_position():
    made = echo()
    made.data[2, 17, 5] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"data\[2\]: .* at \[17, 5\]"):
        hrws.Echo(made.data, made.phase_centres, START, SPACING, WAVELENGTH, PRF, VELOCITY)
    with pytest.raises(sarfocus.NumericalError, match=r"data\[2\]: .* at \[17, 5\]"):
        hrws.reconstruct(made, grid())


def test_channels_that_coincide_are_refused_by_name():
    made = echo((0.0, 0.35, 2.0 * STEP))
    with pytest.raises(sarfocus.NumericalError, match="channels 0 and 2 sample the same places along the track"):
        hrws.reconstruct(made, grid())
    # Two bands need no more than the two places that are left.
    assert hrws.channel_weights(made, doppler_bandwidth=100.0).condition_number < 10.0


def test_options_are_checked():
    made = echo()
    bad: list[tuple[dict[str, Any], str]] = [
        ({"reconstruction": "none"}, "reconstruction"),
        ({"interpolation": "none"}, "interpolation"),
        ({"doppler_bandwidth": 181.0}, "doppler_bandwidth"),
        ({"doppler_centroid": np.inf}, "doppler_centroid"),
        ({"margin": 1.0}, "margin"),
        ({"noise": 0.0}, "noise"),
        ({"half_width": 0, "reconstruction": "sub_image"}, "half_width"),
        ({"motion": np.zeros((3, 3))}, "motion"),
        ({"doppler_centroid": 2600.0}, "doppler_bandwidth"),
    ]
    for options, name in bad:
        with pytest.raises(ValueError, match=name):
            hrws.reconstruct(made, grid(), **options)


def test_progress_runs_through_and_stops():
    made = echo()
    seen: list[tuple[int, int]] = []
    hrws.reconstruct(made, grid(), progress=lambda _phase, done, total: seen.append((done, total)))
    assert seen[-1][0] == seen[-1][1]
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    with pytest.raises(sarfocus.Cancelled):
        hrws.reconstruct(made, grid(), progress=lambda *_: False)


def test_the_geometry_of_the_paper_without_ambiguities():
    motion = zhou2022.height_error(1)
    made = zhou2022.simulated((50e3,), motion)
    points = ImageGrid.from_points(zhou2022.stacked(50e3))
    aperture = zhou2022.N_PULSE * zhou2022.VELOCITY / zhou2022.PRF
    found = zhou2022.figures(hrws.reconstruct(made, points, motion, doppler_bandwidth=1900.0), 50e3, aperture)
    # Of a sinc over 10 side lobes.
    assert found["pslr_db"] == pytest.approx(-13.26, abs=0.05)
    assert found["islr_db"] == pytest.approx(-10.11, abs=0.05)
    assert found["ambiguity_db"] <= -60.0
    assert found["shift"] == pytest.approx(0.0, abs=1e-3)
    plain = zhou2022.figures(zhou2022.plain(made, points, motion), 50e3, aperture)
    assert plain["ambiguity_db"] == pytest.approx(-22.4, abs=0.5)  # methods: -22.8 on one cut


@pytest.mark.parametrize("ground_range", [50e3, 60e3, 70e3])
def test_folded_agrees_with_sub_images_in_the_geometry_of_the_paper(ground_range):
    made = zhou2022.simulated((ground_range,), np.zeros((480, 3)), doppler_bandwidth=1900.0)
    points = zhou2022.chip(ground_range, 0.0, (64, 16))
    folded = hrws.reconstruct(made, points, doppler_bandwidth=1900.0)
    literal = hrws.reconstruct(made, points, doppler_bandwidth=1900.0, reconstruction="sub_image")
    # What is left comes from the illumination, which ends within one pulse: some -50 dB of a larger chip. Weights that jump: -27 to -43 dB.
    assert error_db(folded, literal) < -52.0


def test_weights_are_smooth_where_a_band_begins():
    made = zhou2022.simulated((50e3,), np.zeros((480, 3)))
    found = hrws.channel_weights(made, doppler_bandwidth=1900.0)
    jump = np.abs(np.diff(found.weights, axis=0)).max() / np.abs(found.weights).max()
    abrupt = hrws.channel_weights(made, doppler_bandwidth=1900.0, margin=0.0)
    assert jump < 0.1  # 2 Hz; the change takes some 40 Hz
    assert np.abs(np.diff(abrupt.weights, axis=0)).max() / np.abs(abrupt.weights).max() > 0.3
