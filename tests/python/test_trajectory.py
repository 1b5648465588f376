"""The motion of the platform from strong points, in the geometry of [Zhou2022, Table 1], channel 1."""

import numpy as np
import pytest

import sarfocus
from reference import trajectory_estimate as oracle

WAVELENGTH = 299792458.0 / 9.6e9
SCENE = {"range_start": 53700.0, "range_spacing": 299792458.0 / 2 / 200e6, "wavelength": WAVELENGTH}
PULSES = 364  # the aperture at 60 km
N_RANGE = 13000
TRACK = np.stack([np.zeros(PULSES), (np.arange(PULSES) - PULSES / 2) * 1900.0 / 700.0, np.full(PULSES, 20e3)], axis=1)
POINTS = np.array([[50e3, 0.0, 0.0], [60e3, 0.0, 0.0]])
REGIONS = [sarfocus.ImageGrid.plane((x - 1.5, -1.5, 0.0), (0.0, 0.25, 0.0), (0.25, 0.0, 0.0), (13, 13)) for x in POINTS[:, 0]]


def white(seed):
    """Return an error of the height uniform in +-0.5 wavelengths."""
    error = np.zeros((PULSES, 3))
    error[:, 2] = np.random.default_rng(seed).uniform(-0.5, 0.5, PULSES) * WAVELENGTH
    return error


def echoes(error, points=POINTS, **options):
    amplitudes = np.exp(1j * np.arange(len(points)))
    return sarfocus.simulate.points(TRACK + error, points, amplitudes, n_range=N_RANGE, bandwidth=150e6, **options, **SCENE)


def without_line(values):
    k = np.arange(len(values))
    return values - np.polynomial.polynomial.polyval(k, np.polynomial.polynomial.polyfit(k, values, 1)).T


def rms(found, error):
    """In wavelengths, a constant and a line over the pulses removed."""
    return np.sqrt(np.mean(without_line(found.motion - error) ** 2, axis=0)) / WAVELENGTH


@pytest.mark.parametrize("seed", range(5))
def test_heights_are_found_blind(seed):
    error = white(seed)
    found = sarfocus.estimate_trajectory(echoes(error), TRACK, REGIONS, **SCENE)
    assert found.status is sarfocus.TrajectoryStatus.converged, found.reason
    # Required of the method; 3e-6 measured.
    assert rms(found, error)[2] < 1e-4
    assert found.line_removed
    assert (np.diff(found.objective) > -1e-12).all()  # rounding of sums near 1
    assert (found.points["held_out"] > 0.99).all()


def test_points_off_the_middle_of_their_chips():
    error = white(7)
    data = echoes(error, np.add(POINTS, [[0.4, 1.1, 0.0], [-0.3, -1.2, 0.0]]))
    found = sarfocus.estimate_trajectory(data, TRACK, REGIONS, **SCENE)
    # Targets 2.3 m apart along the track, more than two cells; methods: 0.002 wavelengths.
    assert rms(found, error)[2] < 2e-3


@pytest.mark.parametrize("noise_power", [0.01, 0.1])
def test_noise(noise_power):
    error = white(7)
    found = sarfocus.estimate_trajectory(echoes(error, noise_power=noise_power, seed=3), TRACK, REGIONS, **SCENE)
    off = np.abs(without_line(found.motion - error)[:, 2]) / WAVELENGTH
    # Free heights of two points: at 10 dB a sample one in a hundred pulses may land a turn of the phase (1.35 wavelengths) away, the
    # others scatter as motion_std says.
    turned = off > 0.6
    assert turned.mean() < 0.01
    assert np.sqrt(np.mean(off[~turned] ** 2)) == pytest.approx(np.mean(found.motion_std[:, 2]) / WAVELENGTH, rel=0.5)


def test_coherence_agrees_with_the_oracle():
    error = white(1)
    data = echoes(error)
    found = sarfocus.estimate_trajectory(data, TRACK, REGIONS, **SCENE)
    terms = sarfocus.backproject_histories(data, TRACK, found.points["position"], **SCENE).astype(np.complex128)
    for b, point in zip(terms, found.points, strict=True):
        expected = oracle.coherence(b, TRACK, found.motion, point["position"], WAVELENGTH)
        assert point["coherence"] == pytest.approx(expected, abs=1e-3)  # the removed line and the moved pixel: second order
    # The end of the alternation is a fixed point of the oracle's step; its grid is 2 search / 4000 apart.
    search = 0.7 * WAVELENGTH
    height = found.motion[:, 2]
    again = oracle.step(terms, TRACK, height, found.points["position"], wavelength=WAVELENGTH, search=search)
    assert np.median(np.abs(again - height)) < search / 1000


def test_any_threads_and_strides_give_the_same_bits():
    data = echoes(white(2), noise_power=0.01, seed=1)
    one = sarfocus.estimate_trajectory(data, TRACK, REGIONS, threads=1, **SCENE)
    two = sarfocus.estimate_trajectory(np.asfortranarray(data), TRACK, REGIONS, threads=2, **SCENE)
    np.testing.assert_array_equal(one.motion, two.motion)
    np.testing.assert_array_equal(one.motion_std, two.motion_std)


def test_noise_alone_moves_nothing():
    data = sarfocus.simulate.points(TRACK, POINTS, np.zeros(2), n_range=N_RANGE, bandwidth=150e6, noise_power=1.0, seed=3, **SCENE)
    found = sarfocus.estimate_trajectory(data, TRACK, REGIONS, **SCENE)
    assert found.status is sarfocus.TrajectoryStatus.not_improved
    assert not found.motion.any()
    assert "random phases" in found.reason


def test_a_good_path_is_left_alone():
    found = sarfocus.estimate_trajectory(echoes(np.zeros((PULSES, 3)), noise_power=0.1, seed=3), TRACK, REGIONS, **SCENE)
    assert found.status is sarfocus.TrajectoryStatus.not_improved
    assert not found.motion.any()


def test_what_cannot_be_told_apart_is_named():
    data = echoes(white(0))
    alone = sarfocus.estimate_trajectory(data, TRACK, REGIONS[:1], **SCENE)
    assert alone.status is sarfocus.TrajectoryStatus.not_improved
    assert "at least 2 regions" in alone.reason
    same = sarfocus.estimate_trajectory(data, TRACK, [REGIONS[0], REGIONS[0]], **SCENE)
    assert same.status is sarfocus.TrajectoryStatus.not_improved
    assert "different ranges" in same.reason
    free = sarfocus.estimate_trajectory(data, TRACK, REGIONS, unknowns="cross_track", **SCENE)
    assert "at least 3 regions" in free.reason
    assert not free.motion.any()


def test_bad_input_is_refused():
    data = np.zeros((16, 64), dtype=np.complex64)
    track = np.stack([np.zeros(16), np.arange(16.0), np.full(16, 20e3)], axis=1)
    scene = SCENE | {"range_start": 53850.0}
    with pytest.raises(ValueError, match="regions"):
        sarfocus.estimate_trajectory(data, track, [], **scene)
    with pytest.raises(sarfocus.ShapeError, match="positions"):
        sarfocus.estimate_trajectory(data, track[:-1], REGIONS, **scene)
    with pytest.raises(ValueError, match="unknowns"):
        sarfocus.estimate_trajectory(data, track, REGIONS, unknowns="roll", **scene)
    with pytest.raises(ValueError, match="knots"):
        sarfocus.estimate_trajectory(data, track, REGIONS, knots=-1, **scene)
    broken = data.copy()
    broken[3, 5] = np.nan
    with pytest.raises(sarfocus.NumericalError, match="3, 5"):
        sarfocus.estimate_trajectory(broken, track, REGIONS, **scene)


def test_sharpest_phase_focuses_the_region():
    """One phase per pulse focuses the chip it comes from."""
    data = echoes(white(4))
    phase = sarfocus.sharpest_phase(data, TRACK, REGIONS[0], **SCENE)
    turned = (data * np.exp(-1j * phase)[:, None]).astype(np.complex64)
    before = np.abs(sarfocus.backproject(data, TRACK, REGIONS[0], **SCENE)).max()
    after = np.abs(sarfocus.backproject(turned, TRACK, REGIONS[0], **SCENE)).max()
    assert after > 2 * before  # coherence 0.1 to nearly 1 in the noise-free chip: amplitude by 3
