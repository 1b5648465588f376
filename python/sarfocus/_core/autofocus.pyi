from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import ImageGrid, StripmapGeometry

class PhaseEstimate:
    @property
    def phase(self) -> NDArray[np.float64]: ...
    @property
    def phase_std(self) -> NDArray[np.float64]: ...
    @property
    def linear_terms(self) -> NDArray[np.float64]: ...
    @property
    def amplitude(self) -> NDArray[np.complex128]: ...
    @property
    def signal_power(self) -> NDArray[np.float64]: ...
    @property
    def noise_power(self) -> NDArray[np.float64]: ...
    @property
    def iterations(self) -> int: ...

def estimate_phase(
    lines: NDArray[np.complex64],
    *,
    estimator: Literal["ml", "gradient"] = "ml",
    linear_terms: bool = True,
    max_iterations: int = 100,
    tolerance: float = 1e-4,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> PhaseEstimate: ...

class Status(Enum):
    converged = 0
    max_iterations = 1
    not_improved = 2
    no_strong_points = 3
    gaps = 4

class Result:
    @property
    def image(self) -> NDArray[np.complex64]: ...
    @property
    def phase_error(self) -> NDArray[np.float64]: ...
    @property
    def phase_std(self) -> NDArray[np.float64]: ...
    @property
    def estimate(self) -> NDArray[np.float64]: ...
    @property
    def status(self) -> Status: ...
    @property
    def points(self) -> NDArray[np.void]: ...
    @property
    def diagnostics(self) -> dict[str, Any]: ...
    def summary(self) -> str: ...

def pga(
    image: NDArray[np.complex64],
    *,
    estimator: Literal["ml", "gradient"] = "ml",
    coarse_windows: Sequence[float] = ...,
    coarse_points: int = 100,
    fine_points: int = 2000,
    minimum_contrast: float = 12.0,
    fine_rounds: int = 6,
    tolerance: float = 0.005,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
def pga_2d(
    image: NDArray[np.complex64],
    *,
    bandwidth_ratio: float | None = None,
    model: Literal["range_doppler", "polar_format"] = "range_doppler",
    passes: int = 3,
    estimator: Literal["ml", "gradient"] = "ml",
    coarse_windows: Sequence[float] = ...,
    coarse_points: int = 100,
    fine_points: int = 2000,
    minimum_contrast: float = 12.0,
    fine_rounds: int = 6,
    tolerance: float = 0.005,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
def correct_two_dimensional(
    image: NDArray[np.complex64],
    phase: ArrayLike,
    bandwidth_ratio: float,
    *,
    model: Literal["range_doppler", "polar_format"] = "range_doppler",
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def gpga(
    data: NDArray[np.complex64],
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    grid: ImageGrid,
    *,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    estimator: Literal["ml", "gradient"] = "ml",
    coarse_windows: Sequence[float] = ...,
    coarse_points: int = 100,
    fine_points: int = 2000,
    minimum_contrast: float = 12.0,
    fine_rounds: int = 6,
    tolerance: float = 0.005,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
def minimum_entropy(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry | None = None,
    *,
    smooth_rounds: int = 12,
    free_rounds: int = 60,
    polynomial: int = 6,
    search: float = 40.0,
    tolerance: float = 2e-5,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
def maximum_contrast(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry | None = None,
    *,
    smooth_rounds: int = 12,
    free_rounds: int = 60,
    polynomial: int = 6,
    search: float = 40.0,
    tolerance: float = 2e-5,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...

class TimeOffsetStatus(Enum):
    converged = 0
    not_improved = 1
    at_the_edge = 2

class TimeOffset:
    @property
    def offset(self) -> float: ...
    @property
    def estimate(self) -> float: ...
    @property
    def offset_std(self) -> float: ...
    @property
    def log_sharpness_before(self) -> float: ...
    @property
    def log_sharpness_after(self) -> float: ...
    @property
    def offsets(self) -> NDArray[np.float64]: ...
    @property
    def log_sharpness(self) -> NDArray[np.float64]: ...
    @property
    def held_out_gain(self) -> float: ...
    @property
    def held_out_noise(self) -> float: ...
    @property
    def status(self) -> TimeOffsetStatus: ...
    @property
    def reason(self) -> str: ...

def estimate_time_offset(
    data: NDArray[np.complex64],
    pulse_time: ArrayLike,
    track_time: ArrayLike,
    track_position: ArrayLike,
    grid: ImageGrid,
    *,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    start: float = 0.0,
    search: float = 0.2,
    step: float = 0.025,
    minimum_step: float = 0.0,
    do_no_harm: bool = True,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> TimeOffset: ...
def autofocus(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry | None = None,
    *,
    method: str = "auto",
    methods: Sequence[str] = ...,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
def method_names(*, strip: bool) -> list[str]: ...

class TrajectoryStatus(Enum):
    converged = 0
    max_iterations = 1
    not_improved = 2

class Trajectory:
    @property
    def motion(self) -> NDArray[np.float64]: ...
    @property
    def motion_std(self) -> NDArray[np.float64]: ...
    @property
    def estimate(self) -> NDArray[np.float64]: ...
    @property
    def points(self) -> NDArray[np.void]: ...
    @property
    def coherence_before(self) -> float: ...
    @property
    def coherence(self) -> float: ...
    @property
    def coherence_by_chance(self) -> float: ...
    @property
    def chance_std(self) -> float: ...
    @property
    def condition(self) -> float: ...
    @property
    def line_removed(self) -> bool: ...
    @property
    def rounds(self) -> int: ...
    @property
    def objective(self) -> NDArray[np.float64]: ...
    @property
    def timings(self) -> dict[str, float]: ...
    @property
    def status(self) -> TrajectoryStatus: ...
    @property
    def reason(self) -> str: ...

def estimate_trajectory(
    data: NDArray[np.complex64],
    positions: ArrayLike,
    regions: Sequence[ImageGrid],
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    unknowns: Literal["height", "cross_track", "full"] = "height",
    pixels: Literal["joint", "brightest"] = "joint",
    knots: int | None = None,
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
    start: ArrayLike | None = None,
    search: float = 0.0,
    rounds: int = 3,
    iterations: int = 200,
    tolerance: float = 1e-10,
    do_no_harm: bool = True,
) -> Trajectory: ...
def sharpest_phase(
    data: NDArray[np.complex64],
    positions: ArrayLike,
    region: ImageGrid,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    iterations: int = 200,
    tolerance: float = 1e-08,
) -> NDArray[np.float64]: ...

class Ridges:
    @property
    def range(self) -> NDArray[np.float64]: ...
    @property
    def ridges(self) -> NDArray[np.void]: ...
    @property
    def dropped(self) -> int: ...
    @property
    def reason(self) -> str: ...

class RidgePathStatus(Enum):
    converged = 0
    max_iterations = 1
    not_determined = 2

class RidgePath:
    @property
    def positions(self) -> NDArray[np.float64]: ...
    @property
    def motion(self) -> NDArray[np.float64]: ...
    @property
    def motion_std(self) -> NDArray[np.float64]: ...
    @property
    def points(self) -> NDArray[np.void]: ...
    @property
    def residual_rms(self) -> float: ...
    @property
    def coverage(self) -> float: ...
    @property
    def length_ratio(self) -> float: ...
    @property
    def length_std(self) -> float: ...
    @property
    def rejected(self) -> int: ...
    @property
    def iterations(self) -> int: ...
    @property
    def status(self) -> RidgePathStatus: ...
    @property
    def reason(self) -> str: ...

def track_ridges(
    data: NDArray[np.complex64],
    *,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    resolution: float,
    most: int = 8,
    half_window: int = 10,
    largest_rate: float = 0.0,
    threshold_db: float = 13.0,
    smallest_change: float = 0.0,
    shortest: float = 0.2,
    pieces: bool = False,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Ridges: ...
def trajectory_from_ridges(
    range: ArrayLike,
    start: ArrayLike,
    *,
    look: tuple[float, float, float] = (0.0, 0.0, 0.0),
    across: bool = False,
    knots: int = 10,
    range_std: float = 0.003,
    correlation: int = 10,
    offset_std: float = 0.02,
    step_change: float = 0.0,
    length_std: float = 0.3,
    across_std: float = 0.1,
    largest_residual: float = 0.015,
    iterations: int = 200,
    tolerance: float = 1e-08,
) -> RidgePath: ...
