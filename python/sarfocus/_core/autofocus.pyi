from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

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
