"""Ridges and the path they tell, against echoes written down from the geometry."""

import numpy as np
import pytest

import sarfocus
from sarfocus import RidgePathStatus, ShapeError
from sarfocus.experiments import bwsi
from sarfocus.motion import moving_pulses

N_PULSE, N_RANGE = 240, 420
RADAR = {"range_start": 6.0, "range_spacing": 0.009, "wavelength": 0.073}
RESOLUTION = 0.107
PLACES = np.array([[-1.8, 7.2, 0.0], [2.1, 7.0, 0.0], [0.3, 6.4, 0.0]])
T = np.linspace(-0.5, 0.5, N_PULSE)
LOOK = (0.0, 1.0, 0.0)


def wavy(length=3.0):
    """A track of uneven speed: 16 cm along, two periods."""
    return np.stack([length * T + 0.16 * np.sin(4 * np.pi * T), 0 * T, 0 * T], axis=1)


def line(length):
    return np.stack([length * T, 0 * T, 0 * T], axis=1)


def echoes(path, places=PLACES[:2], noise=0.3, seed=1):
    """Gaussian pulses of the width of a range cell with the carrier's phase; noise of that amplitude, RMS."""
    bins = RADAR["range_start"] + RADAR["range_spacing"] * np.arange(N_RANGE)
    rng = np.random.default_rng(seed)
    out = noise / np.sqrt(2) * (rng.standard_normal((N_PULSE, N_RANGE)) + 1j * rng.standard_normal((N_PULSE, N_RANGE)))
    for place in places:
        distance = np.linalg.norm(path - place, axis=1)[:, None]
        out += np.exp(-2 * ((bins - distance) / RESOLUTION) ** 2 - 4j * np.pi * distance / RADAR["wavelength"])
    return out.astype(np.complex64)


@pytest.fixture(scope="module")
def ridges():
    return sarfocus.track_ridges(echoes(wavy()), resolution=RESOLUTION, **RADAR)


def test_path_within_a_sixth_of_the_wavelength(ridges):
    found = sarfocus.trajectory_from_ridges(ridges.range, line(2.2), look=LOOK)
    assert found.status is RidgePathStatus.converged
    difference = bwsi.path_difference(np.asarray(found.positions), wavy())
    # Two ranges good to 1 to 2 mm, seen at 15 degrees from broadside on average, divide by its sine.
    assert difference["rms_rigid"] < 0.012
    assert difference["rms_scaled"] < 0.008
    assert bwsi.path_difference(line(2.2), wavy())["rms_rigid"] > 0.2
    places = np.sort(found.points["position"][:, 0])
    np.testing.assert_allclose(np.diff(places), 3.9, rtol=0.02)


def test_path_focuses_the_scatterers(ridges):
    """Coherence at the best pixel near each: of the line, of the path found."""
    found = sarfocus.trajectory_from_ridges(ridges.range, line(2.2), look=LOOK)
    data = echoes(wavy())

    def coherence(positions, place):
        grid = sarfocus.ImageGrid.plane(place - (0.2, 0.2, 0.0), (0.01, 0, 0), (0, 0.01, 0), (41, 41))
        at = np.abs(sarfocus.backproject(data, positions, grid, **RADAR))
        row, column = np.unravel_index(at.argmax(), at.shape)
        terms = sarfocus.backproject_histories(data, positions, np.asarray(grid.position(float(row), float(column)))[None], **RADAR)
        return np.abs(terms.sum()) ** 2 / np.abs(terms).sum() ** 2

    for point in found.points:
        # 0.3 of noise per sample, RMS: 0.92 is what the truth reaches; 1.5 mm of range cost 0.06 more.
        assert coherence(np.asarray(found.positions), point["position"]) > 0.8
        assert coherence(line(2.2), point["position"]) < 0.3


def test_strided_data_and_threads_make_no_difference(ridges):
    wide = np.zeros((2 * N_PULSE, N_RANGE), np.complex64)
    wide[::2] = echoes(wavy())
    again = sarfocus.track_ridges(wide[::2], resolution=RESOLUTION, threads=2, **RADAR)
    np.testing.assert_array_equal(again.range, ridges.range)


def test_half_the_range_samples_do(ridges):
    """18 mm apart is still six samples to a cell: the search refines its bins itself."""
    coarse = RADAR | {"range_spacing": 0.018}
    found = sarfocus.track_ridges(np.ascontiguousarray(echoes(wavy())[:, ::2]), resolution=RESOLUTION, **coarse)
    assert len(found.range) == 2
    difference = np.sort(found.range, axis=0) - np.sort(ridges.range, axis=0)
    assert np.nanstd(difference) < 0.004


def test_what_ridges_cannot_tell_is_left_as_it_was(ridges):
    moved = np.add(line(2.2), (5.0, -3.0, 2.0))
    here = sarfocus.trajectory_from_ridges(ridges.range, line(2.2), look=LOOK)
    there = sarfocus.trajectory_from_ridges(ridges.range, moved, look=LOOK)
    np.testing.assert_allclose(there.motion, here.motion, rtol=0, atol=1e-6)
    assert abs(np.mean(here.motion[:, 0])) < 1e-3


def test_short_track_says_that_it_does_not_know_its_length():
    """20 cm of track, 7 m away: the ridges are lines, and the length stays as given."""
    exact = np.linalg.norm(0.2 * T[:, None, None] * np.array([1.0, 0, 0]) - PLACES[:2], axis=2).T
    found = sarfocus.trajectory_from_ridges(exact, line(0.2), look=LOOK, length_std=0.05)
    assert found.length_std > 0.03


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_ridges_are_no_error(ridges, count):
    found = sarfocus.trajectory_from_ridges(ridges.range[:count], line(2.2), look=LOOK)
    assert found.status is RidgePathStatus.not_determined
    assert not found.motion.any()
    assert np.isnan(found.motion_std).all()
    assert f"{count} of {count}" in found.reason


def test_hostile_input(ridges):
    data = echoes(wavy())
    data[3, 4] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"3, 4"):
        sarfocus.track_ridges(data, resolution=RESOLUTION, **RADAR)
    with pytest.raises(ValueError, match="resolution"):
        sarfocus.track_ridges(echoes(wavy()), resolution=0.0, **RADAR)
    with pytest.raises(ShapeError, match="range_start"):
        sarfocus.track_ridges(echoes(wavy()), resolution=RESOLUTION, **RADAR | {"range_start": np.full(N_PULSE, 6.0)})
    with pytest.raises(sarfocus.NumericalError):
        sarfocus.trajectory_from_ridges(ridges.range, line(np.nan), look=LOOK)
    with pytest.raises(ValueError, match="look"):
        sarfocus.trajectory_from_ridges(ridges.range, line(2.2), look=(1.0, 0.0, 0.0))
    with pytest.raises(ShapeError, match="range"):
        sarfocus.trajectory_from_ridges(ridges.range[:, 1:], line(2.2), look=LOOK)


def test_silence_is_no_error():
    silent = sarfocus.track_ridges(np.zeros((N_PULSE, N_RANGE), np.complex64), resolution=RESOLUTION, **RADAR)
    found = sarfocus.trajectory_from_ridges(silent.range, line(2.2), look=LOOK)
    assert silent.reason == "the echoes are zero"
    assert found.status is RidgePathStatus.not_determined


def test_pieces_of_ridges_that_go_on_with_another_scatterer(ridges):
    """Behind a gap each ridge follows the other scatterer: whole, no path fits; in pieces, the path is found as before."""
    wrong = ridges.range.copy()
    wrong[:, 115:125] = np.nan
    wrong[0, 125:], wrong[1, 125:] = ridges.range[1, 125:], ridges.range[0, 125:]
    pieces = np.full((4, N_PULSE), np.nan)
    pieces[:2, :115], pieces[2:, 125:] = wrong[:, :115], wrong[:, 125:]
    whole = sarfocus.trajectory_from_ridges(wrong, line(2.2), look=LOOK)
    found = sarfocus.trajectory_from_ridges(pieces, line(2.2), look=LOOK)
    assert whole.status is RidgePathStatus.not_determined or whole.residual_rms > 0.02
    assert found.residual_rms < 0.004
    # Half the track tells the length, and so the shape, less well than the whole.
    assert bwsi.path_difference(np.asarray(found.positions), wavy())["rms_scaled"] < 0.02


def test_recordings_that_cannot_be_used(tmp_path):
    good = {
        "scan_data": np.random.default_rng(5).standard_normal((120, 200)),
        "scan_time_s": np.arange(120) / 50.0,
        "range_bins_m": 4.0 + 0.009 * np.arange(200),
    }
    path = tmp_path / bwsi.RAIL

    def refused(message, kind=ValueError, **changed):
        np.savez(path, **{name: value for name, value in (good | changed).items() if value is not None})
        with pytest.raises(kind, match=message):
            bwsi.estimate(path, 1)

    with pytest.raises(ValueError, match="no such file"):
        bwsi.estimate(path, 1)
    refused("no path: 0 ridges found")
    refused("expected the field scan_time_s", scan_time_s=None)
    refused("times that rise", scan_time_s=np.full(120, np.nan))
    refused("more than 10 pulses", sarfocus.ShapeError, scan_data=good["scan_data"][:8], scan_time_s=good["scan_time_s"][:8])
    spoilt = good["scan_data"].copy()
    spoilt[7, 9] = np.nan
    refused(r"\[7, 9\]", sarfocus.NumericalError, scan_data=spoilt)


def test_moving_pulses():
    path = wavy()
    path[:60], path[-40:] = path[60], path[-40]
    moving = moving_pulses(echoes(path, noise=0.02))
    assert abs(moving.start - 60) <= 6 and abs(moving.stop - (N_PULSE - 40)) <= 6, "lag of five pulses, one to spare"
    with pytest.raises(ShapeError, match="samples"):
        moving_pulses(np.zeros((10, 4)))
