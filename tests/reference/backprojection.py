"""Slow NumPy oracle of backprojection, written from the equation [methods.md, section 6]."""

import numpy as np
from numpy.typing import NDArray


def ranges(tx: NDArray[np.float64], rx: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the path transmitter - point - receiver, m: [n_pulse, n_point]."""
    forth = np.linalg.norm(points[None] - tx[:, None], axis=2)
    back = np.linalg.norm(points[None] - rx[:, None], axis=2)
    return 0.5 * (forth + back)


def interpolant(profile: NDArray[np.complex128], sample: NDArray[np.float64], padding: int) -> NDArray[np.complex128]:
    """Trigonometric interpolant of a record with zeros behind it, by the explicit sum over its spectrum; zero outside the record."""
    n = len(profile)
    length = n + padding
    spectrum = np.fft.fft(profile, length)
    k = np.fft.fftfreq(length, 1.0 / length)
    if length % 2 == 0:  # the Nyquist component is shared between both signs
        k = np.append(k, length // 2)
        spectrum[length // 2] *= 0.5
        spectrum = np.append(spectrum, spectrum[length // 2])
    value = np.exp(2j * np.pi * sample[:, None] * k[None] / length) @ spectrum / length
    return np.where((sample >= 0) & (sample <= n - 1), value, 0.0)


def image(
    data: NDArray[np.complexfloating],
    tx: NDArray[np.float64],
    rx: NDArray[np.float64],
    points: NDArray[np.float64],
    *,
    range_start: NDArray[np.float64],
    range_spacing: float,
    wavelength: float,
    padding: int,
) -> NDArray[np.complex128]:
    """Sum over pulses of s(R) exp(+4j pi R / lambda), all in double precision: [n_point]."""
    total = np.zeros(len(points), np.complex128)
    r = ranges(tx, rx, points)
    for pulse in range(len(data)):
        sample = (r[pulse] - range_start[pulse]) / range_spacing
        total += interpolant(data[pulse].astype(np.complex128), sample, padding) * np.exp(4j * np.pi * r[pulse] / wavelength)
    return total
