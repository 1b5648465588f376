"""Measured ultra-wideband echoes (BWSI rail): demodulation and backprojection against the plain sum at the delay."""

from pathlib import Path

import numpy as np
import scipy.signal

import sarfocus


def test_demodulated_rail_data_backproject_like_the_plain_sum(data_directory: Path) -> None:
    rail = np.load(data_directory / "bwsi" / "rail_team6_trial6.npz")
    bins = rail["range_bins_m"] - rail["range_bias_m_est"]
    spacing = np.diff(bins).mean()
    moments = rail["scan_time_s"] + rail["radar_to_mocap_time_offset_s_est"]
    positions = np.stack([np.interp(moments, rail["mocap_time_s"], axis) for axis in rail["platform_pos_m"].T], axis=1)
    samples = rail["scan_data"] - rail["scan_data"].mean(axis=0)
    points = rail["corner_reflector_pos_m"][:, None] + np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [-0.3, 0.2, 0]])

    analytic = scipy.signal.hilbert(samples, axis=1)
    fine = scipy.signal.resample(analytic, 16 * analytic.shape[1], axis=1)
    expected = np.zeros(points.shape[:2], np.complex128)
    for pulse, position in zip(fine, positions, strict=True):
        distance = np.linalg.norm(points - position, axis=2)
        expected += np.interp(distance, bins[0] + spacing / 16 * np.arange(len(pulse)), pulse, left=0, right=0)

    for wavelength in (0.0731, 0.09):  # the middle of the band, and a carrier beside it: the sum does not depend on it
        data = sarfocus.signal.demodulate(samples, range_start=bins[0], range_spacing=spacing, wavelength=wavelength)
        grid = sarfocus.ImageGrid.from_points(points)
        image = sarfocus.backproject(data, positions, grid, range_start=bins[0], range_spacing=spacing, wavelength=wavelength)
        # 4.1 GHz turns by pi / 30 within a fine sample: linear interpolation of the plain sum errs by (pi / 30)^2 / 8 = -57 dB.
        assert np.linalg.norm(image - expected) < 4e-3 * np.linalg.norm(expected)
