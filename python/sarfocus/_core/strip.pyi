from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .autofocus import Result
from .geometry import StripmapGeometry

point_dtype: np.dtype[np.void]
seam_dtype: np.dtype[np.void]

class Apertures:
    def __len__(self) -> int: ...
    @property
    def lines(self) -> NDArray[np.complex64]: ...
    @property
    def weight(self) -> NDArray[np.float32]: ...
    @property
    def start(self) -> NDArray[np.int64]: ...
    @property
    def count(self) -> NDArray[np.int64]: ...
    @property
    def fm_rate(self) -> NDArray[np.float64]: ...
    @property
    def points(self) -> NDArray[np.void]: ...
    @property
    def window(self) -> float: ...

class CrossTrackError:
    @property
    def displacement(self) -> NDArray[np.float64]: ...
    @property
    def displacement_std(self) -> NDArray[np.float64]: ...
    @property
    def residual_rms(self) -> NDArray[np.float64]: ...
    @property
    def condition(self) -> float: ...

class Stitching:
    @property
    def slope(self) -> NDArray[np.float64]: ...
    @property
    def segment(self) -> NDArray[np.int32]: ...
    @property
    def seams(self) -> NDArray[np.void]: ...
    @property
    def segments(self) -> int: ...

class StripPhase:
    @property
    def phase(self) -> NDArray[np.float64]: ...
    @property
    def phase_std(self) -> NDArray[np.float64]: ...
    @property
    def coverage(self) -> NDArray[np.float64]: ...
    @property
    def slope(self) -> NDArray[np.float64]: ...
    @property
    def signal(self) -> NDArray[np.float64]: ...
    @property
    def noise(self) -> NDArray[np.float64]: ...
    @property
    def information(self) -> NDArray[np.float64]: ...
    @property
    def smoothness(self) -> NDArray[np.float64]: ...
    @property
    def knot(self) -> float: ...

def select_points(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry,
    *,
    points: int = 0,
    cfar: Literal["cell_averaging", "greatest_of", "ordered_statistic"] = "cell_averaging",
    false_alarm_probability: float = 1e-06,
    maximum_contrast: float = 0.25,
    window: int = 0,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.void]: ...
def extract(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry,
    points: NDArray[np.void],
    *,
    window: int = 0,
    taper: float = 0.3,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Apertures: ...
def match_slope(
    apertures: Apertures,
    *,
    pairs_per_point: int = 16,
    minimum_overlap: float = 0.15,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.void]: ...
def match_search(
    apertures: Apertures,
    *,
    width: int = 32,
    largest_width: int = 1024,
    interpolation: bool = True,
    correction: bool = True,
    minimum_overlap: float = 0.05,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.void]: ...
def search_matrix(apertures: Apertures, first: int, second: int, width: int = 32) -> NDArray[np.float64]: ...
def stitch(apertures: Apertures, seams: NDArray[np.void]) -> Stitching: ...
def integrate_gradient(
    apertures: Apertures,
    stitching: Stitching,
    *,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> StripPhase: ...
def refine(
    apertures: Apertures,
    stitching: Stitching,
    *,
    windows: Sequence[float] = ...,
    rounds: int = 6,
    bridge: bool = False,
    tolerance: float = 0.001,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> StripPhase: ...
def azimuth_correct(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry,
    phase: ArrayLike,
    *,
    centres: ArrayLike | None = None,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def cross_track_error(
    block_phase: ArrayLike,
    slant_range: ArrayLike,
    *,
    height: float,
    wavelength: float,
    phase_std: ArrayLike | None = None,
    unknowns: Literal["height", "horizontal", "cross_track"] = "cross_track",
    maximum_condition: float = 100.0,
    model_std: float = 0.1,
) -> CrossTrackError: ...
def cross_track_phase(
    displacement: ArrayLike,
    slant_range: ArrayLike,
    *,
    height: float,
    wavelength: float,
    out: NDArray[np.float64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.float64]: ...
def correct_cross_track(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry,
    displacement: ArrayLike,
    *,
    height: float,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def spga_linear(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry,
    *,
    matching: Literal["slope", "search"] = "slope",
    gauge: Literal["zero_mean_shift", "first_point", "tie_points"] = "zero_mean_shift",
    tie_points: Sequence[tuple[float, int]] = ...,
    refine: bool = True,
    bridge: bool = False,
    range_blocks: int = 1,
    points: int = 0,
    cfar: Literal["cell_averaging", "greatest_of", "ordered_statistic"] = "cell_averaging",
    false_alarm_probability: float = 1e-06,
    maximum_contrast: float = 0.25,
    window: int = 0,
    taper: float = 0.3,
    width: int = 32,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
def spga(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry,
    *,
    iterations: int = 6,
    narrowing: float = 0.7,
    points: int = 0,
    cfar: Literal["cell_averaging", "greatest_of", "ordered_statistic"] = "cell_averaging",
    false_alarm_probability: float = 1e-06,
    maximum_contrast: float = 0.25,
    window: int = 0,
    do_no_harm: bool = True,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> Result: ...
