"""Slow NumPy oracles of sarfocus.detect, written from the equations."""

import functools
import math

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize, special

Pair = tuple[int, int]


@functools.lru_cache
def factor(method: str, counts: tuple[int, int, int], *, probability: float, rank: float) -> float:
    """Threshold factor for unit-mean exponential intensities: the root of P(x > mu * estimate) = probability.

    The mean of n cells has the distribution gamma(n) / n; the k-th smallest of N cells is a sum of independent exponentials with the
    means 1 / (N - i), i < k (Renyi). The expectation of exp(-mu * estimate) is the false-alarm rate. `counts`: reference cells before
    and behind the guard cells, and beside them.
    """
    before, behind, _ = counts
    total = sum(counts)
    if method == "ordered_statistic":
        means = 1 / (total - np.arange(min(max(math.ceil(rank * total), 1), total)))

        def rate(mu: float) -> float:
            return float(np.prod(1 / (1 + mu * means)))
    elif method == "greatest_of" and before > 0 and behind > 0:

        def rate(mu: float) -> float:
            def density(m: float) -> float:
                return float(mu * np.exp(-mu * m) * special.gammainc(before, before * m) * special.gammainc(behind, behind * m))

            return float(integrate.quad(density, 0, np.inf, epsabs=1e-12, epsrel=1e-9, limit=200)[0])
    else:
        n = before + behind if method == "greatest_of" else total

        def rate(mu: float) -> float:
            return float((1 + mu / n) ** -n)

    return float(optimize.brentq(lambda mu: rate(mu) - probability, 1e-3, total / probability, xtol=1e-11))


def cfar(power: NDArray[np.float64], method: str, reference: Pair, guard: Pair, *, probability: float, rank: float) -> NDArray[np.float64]:
    """Intensity over threshold of every cell [Luo2025, section 2.2.1; Xie2023, section 3.1]; 0 where there is no reference cell."""
    rows, columns = power.shape
    row, column = np.indices(power.shape)
    out = np.zeros_like(power)
    for i in range(rows):
        for j in range(columns):
            window = (abs(row - i) <= reference[0] + guard[0]) & (abs(column - j) <= reference[1] + guard[1])
            frame = window & ~((abs(row - i) <= guard[0]) & (abs(column - j) <= guard[1]))
            before, behind = frame & (row < i - guard[0]), frame & (row > i + guard[0])
            counts = (int(before.sum()), int(behind.sum()), int((frame & ~before & ~behind).sum()))
            if (counts[0] + counts[1] if method == "greatest_of" else sum(counts)) == 0:
                continue
            if method == "greatest_of":
                clutter = max(power[half].mean() if half.any() else 0.0 for half in (before, behind))
            elif method == "ordered_statistic":
                clutter = np.sort(power[frame])[min(max(math.ceil(rank * frame.sum()), 1), frame.sum()) - 1]
            else:
                clutter = power[frame].mean()
            out[i, j] = power[i, j] / (factor(method, counts, probability=probability, rank=rank) * clutter)
    return out


def contrast(signal: NDArray[np.complexfloating]) -> float:
    """1 - mean(|S|)^2 / mean(|S|^2) [Xie2023, eq. 5]."""
    amplitude = np.abs(signal.astype(np.complex128))
    return float(1 - amplitude.mean() ** 2 / (amplitude**2).mean())


def local_maxima(power: NDArray[np.float64], half_width: Pair) -> list[Pair]:
    """Pixels > 0 as strong as their whole neighbourhood; of equals the first in index order."""
    found = []
    for i, j in np.ndindex(power.shape):
        top, left = max(0, i - half_width[0]), max(0, j - half_width[1])
        part = power[top : i + half_width[0] + 1, left : j + half_width[1] + 1]
        # argmax names the first of equal values in index order.
        first = np.unravel_index(part.argmax(), part.shape)
        if power[i, j] > 0 and (top + first[0], left + first[1]) == (i, j):
            found.append((i, j))
    return found
