"""Pulses on a track that a clock of its own recorded: placed, weighted by the path they stand for, and the clocks compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from . import ImageGrid, TimeOffset, estimate_time_offset, interpolate_track, path_weights
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
