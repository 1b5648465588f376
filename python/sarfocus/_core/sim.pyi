from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import StripmapGeometry

def points(
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    targets: ArrayLike,
    reflectivity: ArrayLike,
    *,
    n_range: int,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    bandwidth: float,
    window: str | tuple[str | float, ...] | None = None,
    support: float | None = None,
    noise_power: float = 0.0,
    seed: int = 0,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def points_frequency(
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    targets: ArrayLike,
    reflectivity: ArrayLike,
    *,
    n_frequency: int,
    frequency_start: float,
    frequency_spacing: float,
    reference_range: ArrayLike,
    noise_power: float = 0.0,
    seed: int = 0,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def stripmap(
    geometry: StripmapGeometry,
    targets: ArrayLike,
    reflectivity: ArrayLike,
    *,
    n_azimuth: int,
    model: Literal["band_limited", "chirp"] = "band_limited",
    clutter_power: float = 0.0,
    phase_error: ArrayLike | None = None,
    noise_power: float = 0.0,
    seed: int = 0,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def stripmap_echo(
    geometry: StripmapGeometry,
    targets: ArrayLike,
    reflectivity: ArrayLike,
    *,
    n_azimuth: int,
    range_bandwidth: float,
    window: str | tuple[str | float, ...] | None = None,
    phase_error: ArrayLike | None = None,
    noise_power: float = 0.0,
    seed: int = 0,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def motion_error(
    n_pulse: int,
    *,
    prf: float,
    drift: float = 0.0,
    acceleration: float = 0.0,
    random_rms: float = 0.0,
    random_bandwidth: float = 1.0,
    vibrations: Sequence[tuple[float, float]] = ...,
    seed: int = 0,
    axes: int | None = None,
) -> NDArray[np.float64]: ...
