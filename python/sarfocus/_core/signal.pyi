from typing import Literal

import numpy as np
from numpy.typing import NDArray

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
