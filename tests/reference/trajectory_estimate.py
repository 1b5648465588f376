"""NumPy oracle of the motion from strong points [Zhou2022, eq. 9-10]: coherences, and one step of the alternation for the height."""

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Complex = NDArray[np.complex128]


def coherence(terms: Complex, positions: Reals, motion: Reals, point: Reals, wavelength: float) -> float:
    """|sum b_k exp(j psi_k)|^2 / (sum |b_k|)^2, psi from exact ranges."""
    psi = phase(positions, motion, point, wavelength)
    return float(np.abs((terms * np.exp(1j * psi)).sum()) ** 2 / np.abs(terms).sum() ** 2)


def phase(positions: Reals, motion: Reals, point: Reals, wavelength: float) -> Reals:
    """4 pi / wavelength times the change of range."""
    change = np.linalg.norm(positions + motion - point, axis=-1) - np.linalg.norm(positions - point, axis=-1)
    return 4 * np.pi / wavelength * change


def step(terms: Complex, positions: Reals, height: Reals, points: Reals, *, wavelength: float, search: float) -> Reals:
    """Heights that maximise Re sum_m conj(B_m) b_km exp(j psi_km) for the sums of `height`, pulse by pulse on a fine grid."""
    up = np.array([0.0, 0.0, 1.0])
    scaled = terms / np.abs(terms).sum(axis=1, keepdims=True)
    sums = [(b * np.exp(1j * phase(positions, height[:, None] * up, x, wavelength))).sum() for b, x in zip(scaled, points, strict=True)]
    trial = np.linspace(-search, search, 4001)
    value = np.zeros((trial.size, height.size))
    for b, x, total in zip(scaled, points, sums, strict=True):
        psi = phase(positions[None], trial[:, None, None] * up, x, wavelength)
        value += (np.conj(total) * b * np.exp(1j * psi)).real
    return trial[np.argmax(value, axis=0)]
