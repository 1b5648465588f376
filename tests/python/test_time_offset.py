"""Tracks, weights by path length, and the offset between two clocks, through the Python doors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import sarfocus
from reference import trajectory as oracle

OFFSET = 2.137  # s, of the track's clock against the radar's
SCENE = {"range_start": 2.5, "range_spacing": 0.06, "wavelength": 0.07}
GRID = sarfocus.ImageGrid.plane((-2.2, 3.3, 0.0), (0.03, 0.0, 0.0), (0.0, 0.04, 0.0), (147, 85))


@pytest.fixture(scope="module")
def recording() -> dict[str, NDArray[np.generic]]:
    """A radar carried past twelve points: 160 pulses in 8 s, the motion recorded every 20 ms by another clock."""
    rng = np.random.default_rng(4)
    pulse_time = 0.05 * np.arange(160)
    track_time = 0.02 * np.arange(700)
    targets = np.stack([rng.uniform(-2, 2, 12), rng.uniform(3.5, 6.5, 12), np.zeros(12)], axis=1)
    data = sarfocus.simulate.points(
        oracle.carried(pulse_time),
        targets,
        np.exp(2j * np.pi * rng.uniform(size=12)),
        n_range=128,
        bandwidth=1.5e9,
        noise_power=0.05,
        seed=1,
        **SCENE,
    )
    position = oracle.carried(track_time - OFFSET)
    return {"data": data, "pulse_time": pulse_time, "track_time": track_time, "track_position": position}


def estimate(recording, **options):
    return sarfocus.estimate_time_offset(**recording, grid=GRID, minimum_step=1e-4, **SCENE, **options)


@pytest.mark.parametrize("error", [-0.13, 0.05])
def test_offset_is_found(recording, error):
    found = estimate(recording, start=OFFSET + error)
    assert found.status is sarfocus.TimeOffsetStatus.converged, found.reason
    # Twelve points in each other's sidelobes; at 0.4 m/s 2 ms is 0.8 mm, a phase of 0.14 rad at most.
    assert found.offset == found.estimate == pytest.approx(OFFSET, abs=2e-3)
    assert 0 < found.offset_std < 0.02  # an order of magnitude from six points a half; the peak is some 60 ms wide
    assert found.held_out_gain > 3 * found.held_out_noise
    assert (np.diff(found.offsets) > 0).all()


def test_curve_is_the_sharpness_of_weighted_images(recording):
    """A point of the curve against the whole chain in NumPy and `backproject`."""
    found = estimate(recording, start=OFFSET + 0.03)
    for place in (0, 9):
        at = recording["pulse_time"] + found.offsets[place]
        positions = oracle.interpolate_track(recording["track_time"], recording["track_position"], at)
        weights = oracle.path_weights(positions, 1e-4)
        image = sarfocus.backproject((recording["data"] * weights[:, None]).astype(np.complex64), positions, GRID, **SCENE)
        power = np.abs(image.astype(np.complex128)) ** 2
        # The same sums of some 140 terms, in single precision where the image is formed.
        assert found.log_sharpness[place] == pytest.approx(np.log(np.sum(power**2) / np.sum(power) ** 2), abs=1e-5)


def test_start_comes_back_where_it_is_right_or_out_of_reach(recording):
    right = estimate(recording, start=OFFSET)
    assert right.status is sarfocus.TimeOffsetStatus.not_improved
    assert right.offset == OFFSET
    far = estimate(recording, start=OFFSET - 0.12, search=0.1)
    assert far.status is sarfocus.TimeOffsetStatus.at_the_edge
    assert far.offset == OFFSET - 0.12
    assert np.isnan(far.offset_std)
    assert estimate(recording, start=OFFSET, do_no_harm=False).status is sarfocus.TimeOffsetStatus.converged


def test_threads_do_not_matter_and_progress_stops(recording):
    one, two = (estimate(recording, start=OFFSET + 0.05, threads=threads) for threads in (1, 2))
    assert one.offset == two.offset
    np.testing.assert_array_equal(one.log_sharpness, two.log_sharpness)
    with pytest.raises(sarfocus.Cancelled):
        estimate(recording, start=OFFSET, progress=lambda phase, done, total: False)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"pulse_time": np.zeros(3)}, sarfocus.ShapeError),
        ({"pulse_time": np.full(160, np.nan)}, sarfocus.NumericalError),
        ({"track_time": np.zeros(700)}, ValueError),
        ({"track_position": np.zeros((700, 2))}, sarfocus.ShapeError),
        ({"data": np.zeros((160, 128))}, TypeError),
        ({"data": np.zeros((160, 128), np.complex64)}, sarfocus.NumericalError),
    ],
)
def test_hostile_input(recording, change, error):
    with pytest.raises(error):
        estimate({**recording, **change}, start=OFFSET)
    with pytest.raises(ValueError, match="covers all pulses"):
        estimate(recording, start=-1.0)


@settings(max_examples=50)
@given(st.integers(2, 40), st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_weights_and_track_match_the_oracle(n, seed, minimum_step):
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.normal(size=(n, 3)) * rng.integers(0, 2, size=(n, 1)), axis=0)
    path[-1] += 2.0  # moves at least there
    strided = np.repeat(path.T, 2, axis=1)[:, ::2].T
    # Positions of some 10 m in double precision.
    np.testing.assert_allclose(
        sarfocus.path_weights(strided, minimum_step=minimum_step), oracle.path_weights(path, minimum_step), rtol=1e-12, atol=1e-12
    )
    time = np.cumsum(rng.uniform(0.01, 1.0, size=n))
    at = rng.uniform(time[0], time[-1], size=7)
    np.testing.assert_allclose(sarfocus.interpolate_track(time, strided, at), oracle.interpolate_track(time, path, at), rtol=0, atol=1e-12)
    np.testing.assert_allclose(sarfocus.interpolate_track(time, path, time), path, rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match="within the track"):
        sarfocus.interpolate_track(time, path, [time[-1] + 0.1])
