"""Slow NumPy oracles of sarfocus.quality, written from the equations."""

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.complexfloating]


def _intensity(image: Image) -> NDArray[np.float64]:
    wide = image.astype(np.complex128)
    return (wide.real**2 + wide.imag**2).astype(np.float64)


def entropy(image: Image) -> float:
    """-sum P ln P, P the normalised intensity [Xie2023, eq. 23]."""
    p = _intensity(image) / _intensity(image).sum()
    p = p[p > 0]
    return float(-(p * np.log(p)).sum())


def entropy_log10(image: Image) -> float:
    """-sum P log10 P [Luo2025, eq. 19-20, with the repeated factors of the print taken once]."""
    p = _intensity(image) / _intensity(image).sum()
    p = p[p > 0]
    return float((p * np.log10(1 / p)).sum())


def contrast(image: Image) -> float:
    """Population standard deviation of the intensity over its mean."""
    power = _intensity(image)
    return float(power.std() / power.mean())


def sharpness(image: Image) -> float:
    """sum |I|^4 / (sum |I|^2)^2."""
    power = _intensity(image)
    return float((power**2).sum() / power.sum() ** 2)


def psnr(image: Image, reference: Image) -> float:
    """Amplitudes; the peak is the reference's [Luo2025, section 3.2, with MAX taken of the reference]."""
    error = np.sqrt(_intensity(image)) - np.sqrt(_intensity(reference))
    return float(10 * np.log10(_intensity(reference).max() / (error**2).mean()))


def cut_figures(power: NDArray[np.float64], step: float, lobes: float) -> tuple[float, float, float]:
    """IRW, PSLR and ISLR (units of `step`, dB) of the power of an unweighted response, its peak in the middle of the array.

    By definition: width between the -3 dB points; main lobe between the first minima; side lobes from there to (1 + lobes) cells,
    a cell being the distance of the first null.
    """
    middle = power.size // 2
    peak = power[middle]
    half = np.flatnonzero(power < 0.5 * peak)
    left, right = half[half < middle].max(), half[half > middle].min()
    width = (right - (0.5 * peak - power[right]) / (power[right - 1] - power[right])) - (
        left + (0.5 * peak - power[left]) / (power[left + 1] - power[left])
    )
    minima = np.flatnonzero((power[1:-1] <= power[:-2]) & (power[1:-1] < power[2:])) + 1
    null = minima[minima > right].min() - middle
    distance = np.abs(np.arange(power.size) - middle)
    side = power[(distance >= null) & (distance <= null * (1 + lobes))]
    main = power[distance < null]
    return float(width * step), float(10 * np.log10(side.max() / peak)), float(10 * np.log10(side.sum() / main.sum()))
