"""Slow NumPy oracles of the steps of adaptive PGA, written from the paper [Luo2025]."""

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.complexfloating]


def tested_cells(image: Samples, count: int = 5, half_width: tuple[int, int] = (4, 4)) -> list[tuple[int, int]]:
    """Positions of the strongest of the scene (eq. 2-4): the five strongest of every gate, coalesced, the five strongest of those."""
    power = np.abs(image.astype(np.complex128)) ** 2
    best = [(power[i, j], i, j) for j in range(image.shape[1]) for i in np.argsort(-power[:, j], kind="stable")[:count]]
    kept: list[tuple[int, int]] = []
    for value, i, j in sorted(best, key=lambda b: (-b[0], b[1], b[2])):
        if value > 0 and not any(abs(i - a) <= half_width[0] and abs(j - b) <= half_width[1] for a, b in kept):
            kept.append((int(i), int(j)))
    return kept[:count]


def reference_mean(values: NDArray[np.floating], i: int, *, reference: int = 16, guard: int = 3) -> tuple[float, int]:
    """Mean of the reference cells beyond the guard cells, as many as exist, and their number (eq. 5)."""
    steps = np.arange(guard + 1, guard + reference // 2 + 1)
    cells = np.concatenate([i - steps, i + steps])
    cells = cells[(cells >= 0) & (cells < len(values))]
    return float(np.mean(values[cells])), len(cells)


def factor(cells: int, false_alarm_probability: float) -> float:
    """Mu = N (Pfa^(-1/N) - 1)."""
    return cells * (false_alarm_probability ** (-1 / cells) - 1)


def mean_filter(image: Samples) -> NDArray[np.complex128]:
    """Mean of 3 x 3; the border stays (section 2.2.2)."""
    wide = image.astype(np.complex128)
    out = wide.copy()
    inner = (slice(1, -1), slice(1, -1))
    rows, columns = image.shape
    out[inner] = sum(wide[r : rows - 2 + r, c : columns - 2 + c] for r in range(3) for c in range(3)) / 9
    return out


def sub_apertures(n: int, length: int) -> list[tuple[int, int]]:
    """First line and number of lines, overlapping by half (eq. 8), the last cut off at the end of the image."""
    out = [(0, min(length, n))]
    while sum(out[-1]) < n:
        first = out[-1][0] + length // 2
        out.append((first, min(length, n - first)))
    return out


def gate_energies(image: Samples, length: int) -> NDArray[np.float64]:
    """Sum of x conj(x) over every sub-aperture (eq. 9-10)."""
    power = np.abs(image.astype(np.complex128)) ** 2
    return np.array([power[first : first + count].sum(axis=0) for first, count in sub_apertures(len(image), length)])


def choose_gates(energies: NDArray[np.floating], k: int, eta: float) -> list[int]:
    """Eq. 11-13; k is halved, too, while it leaves no gate to compare with."""
    order = np.argsort(-energies, kind="stable")
    while k > 0:
        if k < len(energies) and np.mean(energies[order[:k]]) > eta * np.mean(energies[order[k:]]):
            return [int(j) for j in order[:k]]
        k //= 2
    return []
