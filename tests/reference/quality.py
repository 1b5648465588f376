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
    """Amplitudes; the peak is the reference's [Luo2025, eq. 21, with MAX taken of the reference]."""
    error = np.sqrt(_intensity(image)) - np.sqrt(_intensity(reference))
    return float(10 * np.log10(_intensity(reference).max() / (error**2).mean()))
