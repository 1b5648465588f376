"""Pulses on a track that a clock of its own recorded: placed, weighted by the path they stand for, and the clocks compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from . import ImageGrid, NumericalError, ShapeError, TimeOffset, estimate_time_offset, interpolate_track, path_weights
from .io import PhaseHistory

Progress = Callable[[str, int, int], bool | None] | None


def along_path(history: PhaseHistory) -> PhaseHistory:
    """Weight every pulse by the length of path it stands for and leave out those of a resting platform.

    A platform whose speed changes sees the scene for longest where it is slow; weighted, the views count by their angle, as in an image
    formed at constant speed. A history without a track comes back as it is.
    """
    if history.track is None:
        return history
    positions = history.phase_centres
    weights = path_weights(positions, minimum_step=history.track.minimum_step)
    moving = weights > 0.0
    start = history.range_start
    return PhaseHistory(
        history.data[moving] * weights[moving, None].astype(np.float32),
        positions[moving],
        start[moving] if isinstance(start, np.ndarray) else start,
        history.range_spacing,
        history.wavelength,
        history.metadata | {"recorded_pulses": len(weights), "time_offset": history.track.offset},
    )


def with_time_offset(history: PhaseHistory, offset: float) -> PhaseHistory:
    """Place the pulses on the track anew, with another offset (s) between the clocks."""
    track = history.track
    if track is None:
        raise ValueError("history: expected one with a track of its own clock, got one without")
    positions = interpolate_track(track.time, track.position, track.pulse_time + offset)
    return dataclasses.replace(history, positions=positions, track=dataclasses.replace(track, offset=offset))


def synchronised(
    history: PhaseHistory,
    grid: ImageGrid,
    *,
    search: float = 0.2,
    step: float = 0.025,
    do_no_harm: bool = True,
    threads: int = 0,
    progress: Progress = None,
) -> tuple[PhaseHistory, TimeOffset]:
    """Estimate the offset between the clocks from the history's own and place the pulses with it; see `sarfocus.estimate_time_offset`.

    Raises
    ------
    ValueError
        A history without a track.
    """
    track = history.track
    if track is None:
        raise ValueError("history: expected one with a track of its own clock, got one without")
    found = estimate_time_offset(
        history.data,
        track.pulse_time,
        track.time,
        track.position,
        grid,
        range_start=history.range_start,
        range_spacing=history.range_spacing,
        wavelength=history.wavelength,
        start=track.offset,
        search=search,
        step=step,
        minimum_step=track.minimum_step,
        do_no_harm=do_no_harm,
        threads=threads,
        progress=progress,
    )
    return with_time_offset(history, found.offset), found


def moving_pulses(samples: npt.NDArray[np.number], *, lag: int = 5, share: float = 0.1) -> slice:
    """From the first to the last pulse in which the platform moves, by the echoes alone.

    A resting radar repeats its echo. The platform moves where the power by which the echoes `lag` pulses before and behind differ exceeds
    `share` of what it reaches in the tenth of the pulses that differ most.

    Raises
    ------
    ShapeError
        `samples` is not [n_pulse, n_range] with more than 2 `lag` pulses.
    NumericalError
        A sample is not finite.
    """
    if samples.ndim != 2 or len(samples) <= 2 * lag or samples.size == 0:
        raise ShapeError(f"samples: expected shape (n_pulse, n_range) with more than {2 * lag} pulses, got {samples.shape}")
    finite = np.isfinite(samples)
    if not finite.all():
        raise NumericalError(f"samples: expected finite ones, got another at {[int(at) for at in np.argwhere(~finite)[0]]}")
    difference = samples[2 * lag :].astype(np.complex128) - samples[: -2 * lag]
    power = np.sum(np.abs(difference) ** 2, axis=1)
    changing = np.flatnonzero(power >= share * np.percentile(power, 90)) + lag
    return slice(int(changing[0]), int(changing[-1]) + 1)
