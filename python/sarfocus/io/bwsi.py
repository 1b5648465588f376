"""MIT Beaver Works UAS-SAR recordings: an impulse radar's real samples, with or without motion capture, in an .npz archive."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import ShapeError
from .._core.signal import demodulate
from ..plain import plain
from .errors import FormatError, reading
from .model import FloatArray, PhaseHistory, require_finite
from .numpy_files import load_npz

BAND = (3.4e9, 4.8e9)  # Hz, of the PulsON 440 as recorded
WAVELENGTH = 299792458.0 / (0.5 * (BAND[0] + BAND[1]))  # m, of the middle of the band
RECORDING = ("scan_data", "scan_time_s", "range_bins_m")
MOTION = ("mocap_time_s", "platform_pos_m")
SCENE_SIZE = (8.0, 6.0)  # m, azimuth and range
MIN_STEP = 0.008  # m, a ninth of the wavelength: well below the sampling that a wide beam needs, above the jitter of the motion capture


def is_bwsi(fields: Mapping[str, Any]) -> bool:
    """Whether the archive has the fields of such a recording."""
    return all(name in fields for name in RECORDING)


def read_bwsi(
    path: str | PathLike[str], *, time_offset: float | None = None, range_bias: float | None = None, min_step: float = MIN_STEP
) -> PhaseHistory:
    """Read a recording and make it a phase history.

    The motion capture is interpolated linearly to the time of every pulse. Pulses taken while the platform rested are left out: they
    repeat one view, and the rings they leave hide the scene. Then the mean pulse (direct coupling) is subtracted and the band of the radar
    brought to the carrier convention of the package.

    Parameters
    ----------
    path : path
        ``.npz``.
    time_offset : float, optional
        s, added to the radar's clock to get the motion capture's; by default the estimate in the file.
    range_bias : float, optional
        m, by which the recorded ranges are too long; by default the estimate in the file.
    min_step : float
        m between the positions of pulses that are kept; 0 keeps all. Without motion capture all are kept.

    Raises
    ------
    FormatError
        A file that is missing or damaged, or fields that do not fit together.
    """
    path = Path(path)
    with reading(path):
        fields = load_npz(path)
        if not is_bwsi(fields):
            raise FormatError(f"expected the fields {', '.join(RECORDING)}, got {', '.join(fields) or 'none'}")
        return bwsi_history(fields, path.name, time_offset=time_offset, range_bias=range_bias, min_step=min_step)


def bwsi_history(
    fields: Mapping[str, npt.NDArray[Any]],
    source: str,
    *,
    time_offset: float | None = None,
    range_bias: float | None = None,
    min_step: float = MIN_STEP,
) -> PhaseHistory:
    """Make a phase history of the arrays of a recording; see `read_bwsi`."""
    samples = np.asarray(fields["scan_data"], dtype=np.float64)
    bins = np.asarray(fields["range_bins_m"], dtype=np.float64)
    times = np.asarray(fields["scan_time_s"], dtype=np.float64)
    if samples.ndim != 2 or samples.shape != (times.size, bins.size) or samples.size == 0:
        raise ShapeError(f"scan_data: expected shape (pulses, bins) = ({times.size}, {bins.size}), none zero, got {samples.shape}")
    require_finite(samples, "scan_data")
    bias = float(fields.get("range_bias_m_est", 0.0)) if range_bias is None else range_bias
    metadata: dict[str, Any] = {"source": source, "bandwidth": BAND[1] - BAND[0], "range_bias": bias, "recorded_pulses": len(samples)}
    positions = None
    if all(name in fields for name in MOTION):
        offset = float(fields.get("radar_to_mocap_time_offset_s_est", 0.0)) if time_offset is None else time_offset
        positions = interpolate_motion(times + offset, fields["mocap_time_s"], fields["platform_pos_m"])
        kept = moving(positions, min_step)
        samples, positions = samples[kept], positions[kept]
        metadata |= {"time_offset": offset, "min_step": min_step}
    if "corner_reflector_pos_m" in fields:
        reflectors = np.asarray(fields["corner_reflector_pos_m"], dtype=np.float64)
        metadata |= {"reflectors": plain(reflectors), "scene_centre": plain(reflectors.mean(axis=0)), "scene_size": list(SCENE_SIZE)}
    start, spacing = float(bins[0]) - bias, float(bins[-1] - bins[0]) / (bins.size - 1)
    data = demodulate(samples - samples.mean(axis=0), range_start=start, range_spacing=spacing, wavelength=WAVELENGTH)
    return PhaseHistory(data, positions, start, spacing, WAVELENGTH, metadata)


def moving(positions: FloatArray, min_step: float) -> list[int]:
    """Return the indices of the pulses that lie at least `min_step` from the one kept before them."""
    kept = [0]
    for pulse in range(1, len(positions)):
        if np.linalg.norm(positions[pulse] - positions[kept[-1]]) >= min_step:
            kept.append(pulse)
    return kept


def interpolate_motion(times: FloatArray, motion_times: npt.NDArray[Any], track: npt.NDArray[Any]) -> FloatArray:
    """Position of the platform at `times`, linear between the samples of the motion capture; never beyond its ends."""
    if track.ndim != 2 or track.shape != (motion_times.size, 3):
        raise ShapeError(f"platform_pos_m: expected shape ({motion_times.size}, 3), as mocap_time_s has it, got {track.shape}")
    require_finite(track, "platform_pos_m")
    if times[0] < motion_times[0] or times[-1] > motion_times[-1]:
        raise FormatError(
            f"time offset: the pulses span {times[0]:.3f} to {times[-1]:.3f} s of the motion capture's clock, "
            f"which covers {motion_times[0]:.3f} to {motion_times[-1]:.3f} s"
        )
    return np.stack([np.interp(times, motion_times, track[:, axis]) for axis in range(3)], axis=1)
