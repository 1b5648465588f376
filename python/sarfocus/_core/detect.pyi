from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

_Image: TypeAlias = NDArray[np.complex64] | NDArray[np.float32]
_Points: TypeAlias = NDArray[np.void]
_Method: TypeAlias = Literal["cell_averaging", "greatest_of", "ordered_statistic"]
_Progress: TypeAlias = Callable[[str, int, int], bool | None] | None

point_dtype: np.dtype[Any]

def cfar_1d(
    image: _Image,
    *,
    method: _Method = "cell_averaging",
    false_alarm_probability: float = 1e-06,
    reference: int = 8,
    guard: int = 3,
    rank: float = 0.75,
    out: NDArray[np.bool_] | None = None,
    threads: int = 0,
    progress: _Progress = None,
) -> NDArray[np.bool_]: ...
def cfar_2d(
    image: _Image,
    *,
    method: _Method = "cell_averaging",
    false_alarm_probability: float = 1e-06,
    reference: Sequence[int] = (8, 8),
    guard: Sequence[int] = (3, 3),
    rank: float = 0.75,
    out: NDArray[np.bool_] | None = None,
    threads: int = 0,
    progress: _Progress = None,
) -> NDArray[np.bool_]: ...
def cfar_1d_at(
    image: NDArray[np.complex64],
    cells: Sequence[Sequence[int]],
    *,
    method: _Method = "cell_averaging",
    false_alarm_probability: float = 1e-06,
    reference: int = 8,
    guard: int = 3,
    rank: float = 0.75,
    threads: int = 0,
    progress: _Progress = None,
) -> _Points: ...
def cfar_2d_at(
    image: NDArray[np.complex64],
    cells: Sequence[Sequence[int]],
    *,
    method: _Method = "cell_averaging",
    false_alarm_probability: float = 1e-06,
    reference: Sequence[int] = (8, 8),
    guard: Sequence[int] = (3, 3),
    rank: float = 0.75,
    threads: int = 0,
    progress: _Progress = None,
) -> _Points: ...
def cell_averaging_factor(cells: int, false_alarm_probability: float) -> float: ...
def greatest_of_factor(before: int, behind: int, false_alarm_probability: float) -> float: ...
def ordered_statistic_factor(cells: int, k: int, false_alarm_probability: float) -> float: ...
def local_maxima(
    image: _Image,
    *,
    mask: NDArray[np.bool_] | None = None,
    half_width: Sequence[int] = (1, 1),
    minimum: float = 0.0,
    count: int = 0,
    threads: int = 0,
    progress: _Progress = None,
) -> _Points: ...
def strongest_samples(image: NDArray[np.complex64], count: int = 5, *, threads: int = 0, progress: _Progress = None) -> _Points: ...
def coalesce(points: _Points, half_width: Sequence[int] = (4, 4)) -> _Points: ...
def contrast(signal: NDArray[np.complex64]) -> float: ...
def filter_contrast(points: _Points, maximum: float) -> _Points: ...
def strongest_gates(
    image: NDArray[np.complex64],
    *,
    count: int = 0,
    score: Literal["energy", "peak_to_mean"] = "energy",
    threads: int = 0,
    progress: _Progress = None,
) -> _Points: ...
def spread_evenly(
    points: _Points, n_azimuth: int, *, limit: int = 0, sections: int = 32, order: Literal["intensity", "contrast"] = "intensity"
) -> _Points: ...
def point_limit(n_azimuth: int, iterations: int = 6) -> int: ...
