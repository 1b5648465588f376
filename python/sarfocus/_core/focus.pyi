from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry import ImageGrid, StripmapGeometry

def backproject(
    data: NDArray[np.complex64],
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    grid: ImageGrid,
    *,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    method: Literal["exact", "ffbp"] = "exact",
    target_error_db: float = -60.0,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...

class FactorizedStage:
    @property
    def rows(self) -> int: ...
    @property
    def columns(self) -> int: ...
    @property
    def centres(self) -> int: ...
    @property
    def taps(self) -> int: ...
    @property
    def oversampling(self) -> float: ...

class FactorizedReport:
    @property
    def factorized(self) -> bool: ...
    @property
    def reason(self) -> str: ...
    @property
    def predicted_error_db(self) -> float: ...
    @property
    def stages(self) -> list[FactorizedStage]: ...
    @property
    def pieces(self) -> int: ...
    @property
    def work(self) -> float: ...
    @property
    def memory(self) -> int: ...

def plan_factorized(
    positions: ArrayLike | tuple[ArrayLike, ArrayLike],
    grid: ImageGrid,
    *,
    n_range: int,
    range_start: ArrayLike,
    range_spacing: float,
    wavelength: float,
    target_error_db: float = -60.0,
) -> FactorizedReport: ...
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
    aspect: tuple[tuple[float, float, float], tuple[float, float]] | None = None,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def form_stripmap(
    echo: NDArray[np.complex64],
    geometry: StripmapGeometry,
    chirp: NDArray[np.complex64] | None = None,
    *,
    range_start: float,
    range_sampling: float,
    replica_origin: float = 0.0,
    window: str | tuple[str | float, ...] | None = None,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def estimate_doppler_centroid(
    data: NDArray[np.complex64],
    prf: float,
    *,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> float: ...
def azimuth_compress(
    raw: NDArray[np.complex64],
    geometry: StripmapGeometry,
    *,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def azimuth_decompress(
    image: NDArray[np.complex64],
    geometry: StripmapGeometry,
    *,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...
def range_compress(
    raw: NDArray[np.complex64],
    replica: NDArray[np.complex64],
    *,
    replica_origin: float = 0.0,
    window: str | tuple[str | float, ...] | None = None,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> NDArray[np.complex64]: ...

class RangeCompressed:
    @property
    def data(self) -> NDArray[np.complex64]: ...
    @property
    def range_start(self) -> NDArray[np.float64]: ...
    @property
    def range_spacing(self) -> float: ...
    @property
    def wavelength(self) -> float: ...

def compress_frequency(
    phase_history: NDArray[np.complex64],
    *,
    frequency_start: float,
    frequency_spacing: float,
    reference_range: ArrayLike,
    oversampling: float = 1.5,
    guard: int = 16,
    centre_frequency: float | None = None,
    window: str | tuple[str | float, ...] | None = None,
    out: NDArray[np.complex64] | None = None,
    threads: int = 0,
    progress: Callable[[str, int, int], bool | None] | None = None,
) -> RangeCompressed: ...
