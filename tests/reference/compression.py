"""Slow NumPy oracles of range compression and the analytic signal, written from the equations."""

import numpy as np
from numpy.typing import NDArray

C = 299_792_458.0


def correlate(
    raw: NDArray[np.complexfloating], replica: NDArray[np.complexfloating], weights: NDArray[np.float64], origin: int
) -> NDArray[np.complex128]:
    """y[i] = sum over n of raw[i + n - origin] conj(w[n] s[n]) / sum of w |s|^2: the matched filter, 1 for the replica itself."""
    reference = weights * replica.astype(np.complex128)
    padded = np.pad(raw.astype(np.complex128), ((0, 0), (origin, len(replica) - 1 - origin)))
    full = np.array([np.correlate(line, reference, mode="valid") for line in padded])
    return full / np.sum(weights * np.abs(replica.astype(np.complex128)) ** 2)


def phase_history(
    frequency: NDArray[np.float64], reference_range: NDArray[np.float64], ranges: NDArray[np.float64], reflectivity: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """fp[p, m] = sum of a exp(-4j pi f_m (R[p, t] - r0[p]) / c): frequency-domain spotlight data referred to r0."""
    offset = ranges - reference_range[:, None]
    return np.einsum("t,ptm->pm", reflectivity, np.exp(-4j * np.pi * frequency[None, None, :] * offset[:, :, None] / C))


def matched_filter(
    history: NDArray[np.complexfloating],
    frequency: NDArray[np.float64],
    weights: NDArray[np.float64],
    reference_range: float,
    r: NDArray[np.float64],
) -> NDArray[np.complex128]:
    """sum over m of w_m fp[m] exp(+4j pi f_m (r - r0) / c) / sum of w: a at r = R, by the explicit sum."""
    steering = np.exp(4j * np.pi * np.outer(r - reference_range, frequency) / C)
    return steering @ (weights * history.astype(np.complex128)) / weights.sum()
