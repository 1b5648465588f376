from collections.abc import Callable, Sequence
from enum import Enum
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

class SiMecStatus(Enum):
    converged = 0
    max_iterations = 1
    inconsistent = 2
    no_strong_point = 3
    not_improved = 4

class SiMecResult:
    @property
    def image(self) -> NDArray[np.complex64]: ...
    @property
    def motion(self) -> NDArray[np.float64]: ...
    @property
    def motion_std(self) -> NDArray[np.float64]: ...
    @property
    def estimate(self) -> NDArray[np.float64]: ...
    @property
    def regions(self) -> NDArray[np.void]: ...
    @property
    def coherence_before(self) -> float: ...
    @property
    def coherence(self) -> float: ...
    @property
    def coherence_by_chance(self) -> float: ...
    @property
    def spread(self) -> float: ...
    @property
    def contrast(self) -> NDArray[np.float64]: ...
    @property
    def line_removed(self) -> bool: ...
    @property
    def objective(self) -> NDArray[np.float64]: ...
    @property
    def status(self) -> SiMecStatus: ...
    @property
    def reason(self) -> str: ...
    @property
    def timings(self) -> dict[str, float]: ...
    @property
    def threads(self) -> int: ...
    def summary(self) -> str: ...

class PhaseCompensation:
    @property
    def image(self) -> NDArray[np.complex64]: ...
    @property
    def phase_error(self) -> NDArray[np.float64]: ...
    @property
    def status(self) -> str: ...
    @property
    def timings(self) -> dict[str, float]: ...

def si_mec(
    echo: Echo,
    grid: ImageGrid,
    regions: Sequence[ImageGrid],
    unknowns: Literal["height", "cross_track", "full"] = "height",
    reconstruction: Literal["folded", "sub_image"] = "folded",
    *,
    pixels: Literal["joint", "brightest"] = "joint",
    knots: int | None = None,
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
    search: float = 0.0,
    agreement: float = 0.5,
    do_no_harm: bool = True,
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
) -> SiMecResult: ...
def bp_fmsa(
    echo: Echo,
    grid: ImageGrid,
    region: ImageGrid,
    *,
    iterations: int = 200,
    tolerance: float = 1e-08,
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
) -> PhaseCompensation: ...
def pga(
    echo: Echo,
    grid: ImageGrid,
    region: ImageGrid,
    *,
    do_no_harm: bool = True,
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
) -> PhaseCompensation: ...
