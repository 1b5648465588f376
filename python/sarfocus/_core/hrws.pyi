from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import ImageGrid

class Echo:
    def __init__(
        self,
        data: NDArray[np.complex64],
        phase_centres: ArrayLike,
        range_start: ArrayLike,
        range_spacing: float,
        wavelength: float,
        prf: float,
        velocity: float,
        baselines: ArrayLike | None = None,
    ) -> None: ...
    @property
    def data(self) -> NDArray[np.complex64]: ...
    @property
    def phase_centres(self) -> NDArray[np.float64]: ...
    @property
    def range_start(self) -> NDArray[np.float64]: ...
    @property
    def range_spacing(self) -> float: ...
    @property
    def wavelength(self) -> float: ...
    @property
    def prf(self) -> float: ...
    @property
    def velocity(self) -> float: ...
    @property
    def baselines(self) -> NDArray[np.float64] | None: ...

class Sampling:
    @property
    def origin(self) -> list[float]: ...
    @property
    def direction(self) -> list[float]: ...
    @property
    def step(self) -> float: ...
    @property
    def offsets(self) -> NDArray[np.float64]: ...
    @property
    def offset_spread(self) -> float: ...

class ChannelWeights:
    @property
    def frequency(self) -> NDArray[np.float64]: ...
    @property
    def weights(self) -> NDArray[np.complex128]: ...
    @property
    def condition_number(self) -> float: ...
    @property
    def noise_amplification(self) -> float: ...

def sampling(echo: Echo) -> Sampling: ...
def channel_weights(
    echo: Echo,
    *,
    interpolation: Literal["mmse", "yen"] = "mmse",
    doppler_bandwidth: float = 0.0,
    doppler_centroid: float = 0.0,
    margin: float | None = None,
    noise: float = 0.001,
    condition_limit: float = 1000.0,
) -> ChannelWeights: ...
def reconstruct(
    echo: Echo,
    grid: ImageGrid,
    motion: ArrayLike | None = None,
    *,
    reconstruction: Literal["folded", "sub_image"] = "folded",
    interpolation: Literal["mmse", "yen"] = "mmse",
    doppler_bandwidth: float = 0.0,
    doppler_centroid: float = 0.0,
    margin: float | None = None,
    noise: float = 0.001,
    condition_limit: float = 1000.0,
    half_width: int = 8,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
