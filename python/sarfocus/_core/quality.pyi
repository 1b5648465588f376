from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

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
