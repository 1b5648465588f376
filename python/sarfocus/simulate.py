"""Simulated echoes: the forward model, independent of the image formation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from ._core.focus import project
from ._core.geometry import ImageGrid
from ._core.hrws import Echo
from ._core.sim import hrws_data, motion_error, points, points_frequency, stripmap, stripmap_echo

__all__ = ["hrws", "hrws_data", "hrws_scene", "motion_error", "points", "points_frequency", "stripmap", "stripmap_echo"]


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

    Extended scenes: `hrws_scene`.

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
    baselines = antennas - antennas[transmitter] if model == "bistatic" else None
    return Echo(
        data, _centres(platform, antennas, transmitter), range_start, range_spacing, wavelength, prf, _speed(platform, prf), baselines
    )


def hrws_scene(
    positions: ArrayLike,
    channels: ArrayLike,
    scene: NDArray[np.complex64],
    grid: ImageGrid,
    *,
    n_range: int,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    bandwidth: float,
    prf: float,
    transmitter: int = 0,
    motion: ArrayLike | None = None,
    doppler_bandwidth: float | None = None,
    doppler_centroid: float = 0.0,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Echo:
    """Echoes of an extended scene in every channel: the adjoint of backprojection, limited to the pulse's bandwidth.

    Ranges are those of both legs. The beam ends sharply.

    Parameters
    ----------
    scene : complex64 [grid.shape]
        Reflectivity of every pixel.
    grid : ImageGrid
        Where the scatterers are.
    positions, channels, n_range, range_start, range_spacing, wavelength, prf, transmitter, motion, doppler_bandwidth, doppler_centroid
        As for `hrws`.
    bandwidth : float
        Hz, of the pulse, its spectrum flat.
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
    platform = np.asarray(positions, dtype=np.float64)
    antennas = np.asarray(channels, dtype=np.float64)
    true = platform if motion is None else platform + np.asarray(motion, dtype=np.float64)
    velocity = _speed(platform, prf)
    aspect = None
    if doppler_bandwidth is not None:
        axis = (platform[-1] - platform[0]) / np.linalg.norm(platform[-1] - platform[0])
        ends = np.clip(0.5 * wavelength / velocity * (doppler_centroid + np.array([-0.5, 0.5]) * doppler_bandwidth), -1.0, 1.0)
        aspect = ((float(axis[0]), float(axis[1]), float(axis[2])), (float(ends[0]), float(ends[1])))
    data = np.empty((len(antennas), len(platform), n_range), np.complex64)
    for n, antenna in enumerate(antennas):
        project(
            scene,
            grid,
            (true + antennas[transmitter], true + antenna),
            n_range=n_range,
            range_start=range_start,
            range_spacing=range_spacing,
            wavelength=wavelength,
            aspect=aspect,
            out=data[n],
            threads=threads,
            progress=_part(progress, n, len(antennas)),
        )
        _limit(data[n], bandwidth, range_spacing, threads)
    baselines = antennas - antennas[transmitter]
    return Echo(data, _centres(platform, antennas, transmitter), range_start, range_spacing, wavelength, prf, velocity, baselines)


def _centres(platform: NDArray[np.float64], antennas: NDArray[np.float64], transmitter: int) -> NDArray[np.float64]:
    centres: NDArray[np.float64] = platform[None] + 0.5 * (antennas + antennas[transmitter])[:, None]
    return centres


def _speed(platform: NDArray[np.float64], prf: float) -> float:
    return float(np.linalg.norm(platform[-1] - platform[0]) / (len(platform) - 1) * prf)


def _part(progress: Callable[[str, int, int], bool | None] | None, part: int, parts: int) -> Callable[[str, int, int], bool | None] | None:
    if progress is None:
        return None
    return lambda phase, done, total: progress(phase, done + part * total, parts * total)


def _limit(data: NDArray[np.complex64], bandwidth: float, range_spacing: float, threads: int) -> None:
    """Limit the spectrum along range to the bandwidth about zero, in place; the record is followed by zeros."""
    rows, guard = 64, 256
    n = int(fft.next_fast_len(data.shape[1] + guard))
    inside = np.abs(np.fft.fftfreq(n, 2.0 * range_spacing / 299_792_458.0)) <= 0.5 * bandwidth
    workers = threads if threads > 0 else -1
    for begin in range(0, len(data), rows):
        some = data[begin : begin + rows]
        spectrum = fft.fft(some, n, axis=1, workers=workers)
        some[:] = fft.ifft(spectrum * inside, axis=1, workers=workers)[:, : data.shape[1]]
