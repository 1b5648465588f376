from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

def window(
    name: str | tuple[str | float, ...] | None,
    n: int,
    *,
    form: Literal["symmetric", "periodic"] = "symmetric",
) -> NDArray[np.float64]: ...
def chirp(
    *,
    bandwidth: float,
    duration: float,
    sampling_rate: float,
    direction: Literal["up", "down"] = "up",
) -> NDArray[np.complex64]: ...
def upsample(
    chip: NDArray[np.complex64] | NDArray[np.complex128],
    factor: int,
    *,
    band_centre: tuple[float, float] = (0.0, 0.0),
) -> NDArray[np.complex128]: ...
def analytic_signal(
    samples: ArrayLike,
    *,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def demodulate(
    samples: ArrayLike,
    *,
    range_start: float,
    range_spacing: float,
    wavelength: float,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
