"""MIT Beaver Works UAS-SAR recordings: an impulse radar's real samples, with or without motion capture, in an .npz archive."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import ShapeError
from .._core.geometry import interpolate_track, path_weights
from .._core.signal import demodulate
from ..plain import plain
from .errors import FormatError, reading
from .model import FloatArray, PhaseHistory, Track, require_finite
from .numpy_files import load_npz

BAND = (3.4e9, 4.8e9)  # Hz, of the PulsON 440 as recorded
WAVELENGTH = 299792458.0 / (0.5 * (BAND[0] + BAND[1]))  # m, of the middle of the band
RECORDING = ("scan_data", "scan_time_s", "range_bins_m")
MOTION = ("mocap_time_s", "platform_pos_m")
SCENE_SIZE = (8.0, 6.0)  # m, azimuth and range
MINIMUM_STEP = 0.0015  # m from pulse to pulse, 9 cm/s: above the jitter of the motion capture at rest, a sixth of the usual step


def is_bwsi(fields: Mapping[str, Any]) -> bool:
    """Whether the archive has the fields of such a recording."""
    return all(name in fields for name in RECORDING)


def read_bwsi(
    path: str | PathLike[str], *, time_offset: float | None = None, range_bias: float | None = None, minimum_step: float = MINIMUM_STEP
) -> PhaseHistory:
    """Read a recording and make it a phase history.

    The motion capture is interpolated linearly to the time of every pulse. The mean pulse over the path (direct coupling) is subtracted
    and the band of the radar brought to the carrier convention of the package. All pulses are kept, with the track: `sarfocus.motion`
    finds the offset between the clocks, weights the pulses by the path they stand for and leaves out those of a resting platform, which
    repeat one view, and the rings they leave hide the scene. The functions of `sarfocus.focusing` do so.

    Parameters
    ----------
    path : path
        ``.npz``.
    time_offset : float, optional
        s, added to the radar's clock to get the motion capture's; by default the estimate in the file.
    range_bias : float, optional
        m, by which the recorded ranges are too long; by default the estimate in the file.
    minimum_step : float
        m from pulse to pulse at or below which the platform is taken to rest.

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
        return bwsi_history(fields, path.name, time_offset=time_offset, range_bias=range_bias, minimum_step=minimum_step)


def bwsi_history(
    fields: Mapping[str, npt.NDArray[Any]],
    source: str,
    *,
    time_offset: float | None = None,
    range_bias: float | None = None,
    minimum_step: float = MINIMUM_STEP,
) -> PhaseHistory:
    """Make a phase history of the arrays of a recording; see `read_bwsi`."""
    samples = np.asarray(fields["scan_data"], dtype=np.float64)
    bins = np.asarray(fields["range_bins_m"], dtype=np.float64)
    times = np.asarray(fields["scan_time_s"], dtype=np.float64)
    if samples.ndim != 2 or samples.shape != (times.size, bins.size) or samples.size == 0:
        raise ShapeError(f"scan_data: expected shape (pulses, bins) = ({times.size}, {bins.size}), none zero, got {samples.shape}")
    require_finite(samples, "scan_data")
    bias = float(fields.get("range_bias_m_est", 0.0)) if range_bias is None else range_bias
    metadata: dict[str, Any] = {"source": source, "bandwidth": BAND[1] - BAND[0], "range_bias": bias}
    track = None
    positions = None
    weights = np.ones(times.size)
    if all(name in fields for name in MOTION):
        offset = float(fields.get("radar_to_mocap_time_offset_s_est", 0.0)) if time_offset is None else time_offset
        track = Track(times, fields["mocap_time_s"], fields["platform_pos_m"], offset, minimum_step)
        positions = interpolate_motion(times + offset, track)
        weights = path_weights(positions, minimum_step=minimum_step)
    if "corner_reflector_pos_m" in fields:
        reflectors = np.asarray(fields["corner_reflector_pos_m"], dtype=np.float64)
        metadata |= {"reflectors": plain(reflectors), "scene_centre": plain(reflectors.mean(axis=0)), "scene_size": list(SCENE_SIZE)}
    start, spacing = float(bins[0]) - bias, float(bins[-1] - bins[0]) / (bins.size - 1)
    coupling = np.average(samples, axis=0, weights=weights)
    data = demodulate(samples - coupling, range_start=start, range_spacing=spacing, wavelength=WAVELENGTH)
    return PhaseHistory(data, positions, start, spacing, WAVELENGTH, metadata, track)


def interpolate_motion(times: FloatArray, track: Track) -> FloatArray:
    """Position of the platform at `times`; never beyond the ends of the motion capture."""
    first, last = track.time[0], track.time[-1]
    if times.min() < first or times.max() > last:
        raise FormatError(
            f"time offset: the pulses span {times.min():.3f} to {times.max():.3f} s of the motion capture's clock, "
            f"which covers {first:.3f} to {last:.3f} s"
        )
    return interpolate_track(track.time, track.position, times)
