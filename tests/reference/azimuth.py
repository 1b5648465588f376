"""Slow NumPy oracle of azimuth compression, written from the equations."""

import numpy as np
from numpy.typing import NDArray


def fm_rate(wavelength: float, velocity: float, slant_range: NDArray[np.float64]) -> NDArray[np.float64]:
    """K = 2 v^2 / (lambda R) [Xie2023, eq. 1], Hz/s."""
    return 2 * velocity**2 / (wavelength * slant_range)


def baseband_frequency(n: int, prf: float, doppler_centroid: float) -> NDArray[np.float64]:
    """The alias of every DFT bin's frequency that lies in [centroid - prf/2, centroid + prf/2), Hz."""
    f = np.arange(n) * prf / n
    return f - prf * np.floor((f - doppler_centroid) / prf + 0.5)


def compress(
    raw: NDArray[np.complexfloating],
    *,
    wavelength: float,
    prf: float,
    velocity: float,
    slant_range: NDArray[np.float64],
    doppler_centroid: float,
) -> NDArray[np.complex128]:
    """Spectrum times exp(-j pi (f - fdc)^2 / K): the matched filter of exp(-j pi K t^2), phase only."""
    f = baseband_frequency(len(raw), prf, doppler_centroid) - doppler_centroid
    phase = -np.pi * f[:, None] ** 2 / fm_rate(wavelength, velocity, slant_range)[None, :]
    return np.fft.ifft(np.fft.fft(raw.astype(np.complex128), axis=0) * np.exp(1j * phase), axis=0)
