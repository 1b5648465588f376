from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .autofocus import Result
from .geometry import StripmapGeometry

cell_dtype: np.dtype[np.void]

def cfar_gate(
    image: NDArray[np.complex64],
    *,
    extents: Sequence[int] = ...,
    mu: float = 0.0,
    false_alarm_probability: float = 0.001,
    reference: int = 16,
    guard: int = 3,
    cells: int = 5,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> tuple[bool, NDArray[np.void]]: ...
def gates_to_denoise(n_range: int, centre: int) -> tuple[int, int]: ...
def mean_filter(
    image: NDArray[np.complex64],
    *,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def sub_apertures(n_azimuth: int, length: int) -> list[tuple[int, int]]: ...
def gate_energies(
    image: NDArray[np.complex64],
    length: int,
    *,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.float64]: ...
def choose_gates(energies: ArrayLike, k: int = 128, eta: float = 2.7) -> tuple[NDArray[np.int64], float, float]: ...
def adaptive_pga(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry | None = None,
    *,
    eta: float = 2.7,
    k: int = 128,
    sub_aperture: int = 0,
    weak_scene: Literal["denoise", "skip"] = "denoise",
    bandwidth_ratio: float = 0.0,
    estimator: Literal["ml", "gradient"] = "ml",
    extents: Sequence[int] = ...,
    mu: float = 0.0,
    false_alarm_probability: float = 0.001,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
def conventional_pga(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry | None = None,
    *,
    k: int = 128,
    sub_aperture: int = 0,
    iterations: int = 6,
    narrowing: float = 0.6,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
