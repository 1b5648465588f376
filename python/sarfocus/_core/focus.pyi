from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import ImageGrid

def backproject(
    data: NDArray[np.complex64],
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    grid: ImageGrid,
    *,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    method: Literal["exact"] = "exact",
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def backproject_histories(
    data: NDArray[np.complex64],
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    points: ArrayLike,
    *,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def project(
    scene: NDArray[np.complex64],
    grid: ImageGrid,
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    *,
    n_range: int,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
