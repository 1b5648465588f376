"""Slow NumPy oracle of stripmap image formation: every pixel as the sum over the exact two-dimensional spectrum, in double precision."""

import numpy as np
from numpy.typing import NDArray

from .azimuth import baseband_frequency

C = 299_792_458.0


def image(
    echo: NDArray[np.complexfloating],
    *,
    wavelength: float,
    prf: float,
    velocity: float,
    slant_range: NDArray[np.float64],
    doppler_bandwidth: float,
    doppler_centroid: float,
    range_start: float,
    range_sampling: float,
    padding: int,
) -> NDArray[np.complex128]:
    """Matched filter of the spectrum exp(-4j pi R / c sqrt((f0 + fr)^2 - (c f / 2v)^2)) of a point [Cumming2005, chapter 5] at
    every range gate, no expansion in fr; then the shift from zero Doppler to the beam centre, the time at which f = fdc.
    """
    n_pulse, n_fast_time = echo.shape
    n = n_fast_time + padding
    carrier = C / wavelength
    f = baseband_frequency(n_pulse, prf, doppler_centroid)
    inside = (f - doppler_centroid >= -doppler_bandwidth / 2) & (f - doppler_centroid < doppler_bandwidth / 2)
    fr = np.fft.fftfreq(n, 1 / range_sampling)
    spectrum = np.fft.fft(np.fft.fft(echo.astype(np.complex128), axis=0), n, axis=1)
    out = np.zeros((n_pulse, len(slant_range)), np.complex128)
    centre = np.sqrt(1 - (wavelength * doppler_centroid / (2 * velocity)) ** 2)
    # Beam centre less zero Doppler, s for each metre of range: v t = -R tan(squint), sin(squint) = wavelength fdc / 2v.
    delay = -wavelength * doppler_centroid / (2 * velocity**2 * centre)
    for k in np.flatnonzero(inside):
        root = np.sqrt((carrier + fr) ** 2 - (C * f[k] / (2 * velocity)) ** 2)
        cycles = 2 * np.outer(slant_range, root - carrier) / C - 2 * fr * range_start / C
        cycles -= f[k] * delay * slant_range[:, None]
        out[k] = np.exp(2j * np.pi * cycles) @ spectrum[k] / n
    return np.fft.ifft(out, axis=0)
