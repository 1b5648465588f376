from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
