"""Displacement of the antenna across its track and the phase it makes, from the geometry; one dense least-squares problem."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def phase(displacement: Floats, slant_range: Floats, height: float, wavelength: float) -> Floats:
    """-4 pi / wavelength times the change of the range to flat ground [docs/conventions.md], first order: [n_range, n_azimuth]."""
    theta = np.arccos(height / slant_range)
    change = -np.outer(np.sin(theta), displacement[:, 0]) + np.outer(np.cos(theta), displacement[:, 1])
    return -4 * np.pi / wavelength * change


def without_lines(values: Floats, used: NDArray[np.bool_] | None = None) -> Floats:
    """Constant and line over the samples used taken out of every column."""
    k = np.arange(len(values), dtype=np.float64)
    chosen = np.ones(len(k), bool) if used is None else used
    basis = np.stack([np.ones_like(k), k - k.mean()], axis=1)
    fit = np.linalg.lstsq(basis[chosen], values[chosen], rcond=None)[0]
    return np.asarray(values - basis @ fit)


def invert(block_phase: Floats, phase_std: Floats, slant_range: Floats, height: float, wavelength: float) -> Floats:
    """Both components at every sample, and a constant and a line of every block, all in one system [methods 5]; every sample must be
    reached by two blocks. The smallest solution, then its constants and lines taken out."""
    n_block, n = block_phase.shape
    theta = np.arccos(height / slant_range)
    k = 2 * np.arange(n) / n - 1
    rows, right = [], []
    for b in range(n_block):
        for i in np.flatnonzero(np.isfinite(phase_std[b])):
            row = np.zeros(2 * n + 2 * n_block)
            row[2 * i : 2 * i + 2] = 4 * np.pi / wavelength * np.array([np.sin(theta[b]), -np.cos(theta[b])]) / 400
            row[2 * n + 2 * b : 2 * n + 2 * b + 2] = 1, k[i]
            rows.append(row / phase_std[b, i])
            right.append(block_phase[b, i] / phase_std[b, i])
    solution = np.linalg.lstsq(np.array(rows), np.array(right), rcond=1e-10)[0]
    return without_lines(solution[: 2 * n].reshape(n, 2) / 400)
