from collections.abc import Callable, Sequence
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import StripmapGeometry

_Verdict: TypeAlias = Literal["clipped_by_edge", "broadened", "asymmetric", "high_sidelobes", "good"]

class AxisResponse:
    @property
    def position(self) -> float: ...
    @property
    def irw(self) -> float: ...
    @property
    def irw_cells(self) -> float: ...
    @property
    def pslr_db(self) -> float: ...
    @property
    def pslr_left_db(self) -> float: ...
    @property
    def pslr_right_db(self) -> float: ...
    @property
    def islr_db(self) -> float: ...
    @property
    def nulls(self) -> tuple[float, float]: ...
    @property
    def extent(self) -> tuple[float, float]: ...
    @property
    def theory_irw_cells(self) -> float: ...
    @property
    def theory_pslr_db(self) -> float: ...
    @property
    def theory_islr_db(self) -> float: ...
    @property
    def verdict(self) -> _Verdict: ...
    @property
    def cut(self) -> NDArray[np.float64]: ...
    @property
    def cut_position(self) -> NDArray[np.float64]: ...

class PointResponse:
    @property
    def position(self) -> tuple[float, float]: ...
    @property
    def amplitude(self) -> float: ...
    @property
    def phase(self) -> float: ...
    @property
    def azimuth(self) -> AxisResponse: ...
    @property
    def range(self) -> AxisResponse: ...
    @property
    def verdict(self) -> _Verdict: ...

def point_response(
    image: NDArray[np.complex64],
    position: Sequence[float],
    *,
    upsample: int = 32,
    search: int = 2,
    lobes: int = 10,
    chip: int = 511,
    irw_tolerance: float = 0.05,
    sidelobe_tolerance: float = 1.0,
    oversampling: float | tuple[float | None, float | None] | None = None,
    window: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None,
    band_centre: float | tuple[float | None, float | None] | None = None,
) -> PointResponse: ...
def entropy(image: NDArray[np.complex64], *, threads: int = 0, progress: Callable[[str, int, int], bool | None] | None = None) -> float: ...
def entropy_log10(
    image: NDArray[np.complex64], *, threads: int = 0, progress: Callable[[str, int, int], bool | None] | None = None
) -> float: ...
def contrast(
    image: NDArray[np.complex64], *, threads: int = 0, progress: Callable[[str, int, int], bool | None] | None = None
) -> float: ...
def sharpness(
    image: NDArray[np.complex64], *, threads: int = 0, progress: Callable[[str, int, int], bool | None] | None = None
) -> float: ...
def psnr(
    image: NDArray[np.complex64],
    reference: NDArray[np.complex64],
    *,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> float: ...
def azimuth_ambiguity_offset(*, prf: float, wavelength: float, velocity: float, slant_range: float) -> float: ...
def azimuth_ambiguity_ratio(
    image: NDArray[np.complex64],
    position: Sequence[float],
    offsets: ArrayLike | None = None,
    *,
    geometry: StripmapGeometry | None = None,
    measure: Literal["peak", "energy"] = "peak",
    half_width: Sequence[int] = (8, 8),
) -> tuple[float, NDArray[np.float64]]: ...
