"""Simulated echoes: the forward model, independent of the image formation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core.hrws import Echo
from ._core.sim import hrws_data, motion_error, points, points_frequency, stripmap, stripmap_echo

__all__ = ["hrws", "hrws_data", "motion_error", "points", "points_frequency", "stripmap", "stripmap_echo"]


def hrws(
    positions: ArrayLike,
    channels: ArrayLike,
    targets: ArrayLike,
    reflectivity: ArrayLike,
    *,
    n_range: int,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    bandwidth: float,
    prf: float,
    transmitter: int = 0,
    model: Literal["bistatic", "equivalent"] = "bistatic",
    motion: ArrayLike | None = None,
    imbalance: ArrayLike | None = None,
    doppler_bandwidth: float | None = None,
    doppler_centroid: float = 0.0,
    window: str | tuple[str | float, ...] | None = None,
    support: float | None = None,
    noise_power: float = 0.0,
    seed: int = 0,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Echo:
    """Echoes of point scatterers in every channel, with the phase centres that a radar unaware of its motion error would state.

    Extended scenes: `project` on every channel's true phase centres.

    Parameters
    ----------
    positions : array_like [n_pulse, 3]
        Of the platform without motion error, m, n_pulse >= 2.
    channels : array_like [n_channel, 3]
        Receiving antennas relative to the platform, m.
    targets : array_like [n_target, 3]
        m.
    reflectivity : array_like [n_target], complex
    n_range, range_start, range_spacing, wavelength, bandwidth, window, support
        As for `points`.
    prf : float
        Hz.
    transmitter : int
        Index of the channel that also transmits.
    model : {"bistatic", "equivalent"}
        Ranges: of both legs, or from midway between the antennas. The first are longer by baseline**2 / (8 R); the baselines that account
        for it are part of the echo returned.
    motion : array_like [n_pulse, 3], optional
        Motion error, m: displaces all antennas.
    imbalance : array_like [n_channel], complex, optional
        Factor of every channel.
    doppler_bandwidth : float, optional
        Hz: a scatterer is illuminated by the pulses at which its Doppler frequency is within half of it from the centroid; by all where
        None.
    doppler_centroid : float
        Hz.
    noise_power : float
        Mean square of complex white Gaussian noise, independent between channels.
    seed : int
        Of the noise.
    out : complex64 [n_channel, n_pulse, n_range], optional
        Where the samples go.
    threads : int
        0: all. The result does not depend on it.
    progress : callable (phase, done, total), optional
        Return False to stop.

    Returns
    -------
    hrws.Echo

    Raises
    ------
    ShapeError, ValueError, TypeError, NumericalError, MemoryError
    """
    data = hrws_data(
        positions,
        channels,
        targets,
        reflectivity,
        n_range=n_range,
        range_start=range_start,
        range_spacing=range_spacing,
        wavelength=wavelength,
        bandwidth=bandwidth,
        prf=prf,
        transmitter=transmitter,
        model=model,
        motion=motion,
        imbalance=imbalance,
        doppler_bandwidth=doppler_bandwidth,
        doppler_centroid=doppler_centroid,
        window=window,
        support=support,
        noise_power=noise_power,
        seed=seed,
        out=out,
        threads=threads,
        progress=progress,
    )
    platform = np.asarray(positions, dtype=np.float64)
    antennas = np.asarray(channels, dtype=np.float64)
    centres = platform[None] + 0.5 * (antennas + antennas[transmitter])[:, None]
    step = np.linalg.norm(platform[-1] - platform[0]) / (len(platform) - 1)
    baselines = antennas - antennas[transmitter] if model == "bistatic" else None
    return Echo(data, centres, range_start, range_spacing, wavelength, prf, float(step * prf), baselines)
