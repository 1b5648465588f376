"""Range migration of a path error, from the echo of a scatterer [methods.md, section 0], not from any formula of the correction.

A scatterer at range R echoes at frequency f with phase -4 pi f R / c. Its image is the inverse transform over range frequency (range
increases with the gate) and azimuth frequency; a path longer by displacement(u) while azimuth frequency u is seen changes R there.
"""

import numpy as np

SPEED_OF_LIGHT = 299792458.0
CARRIER = 1.3e9  # Hz
SAMPLING = 400e6  # Hz, of range; 80 % of it is the pulse's bandwidth


def frequencies(n_azimuth, n_range):
    """Azimuth frequency, cycles a sample, and absolute range frequency, Hz, in transform order."""
    return np.fft.fftfreq(n_azimuth)[:, None], CARRIER + SAMPLING * np.fft.fftfreq(n_range)[None, :]


def spectrum(points, displacement, n_azimuth, n_range, *, peak_db=35.0, seed=0):
    """Echo of points (azimuth sample, range gate) in speckle of power one per pixel. displacement(u, f): m."""
    rng = np.random.default_rng(seed)
    u, f = frequencies(n_azimuth, n_range)
    gate = SPEED_OF_LIGHT / 2 / SAMPLING
    echo = np.fft.fft2(rng.standard_normal((n_azimuth, n_range)) + 1j * rng.standard_normal((n_azimuth, n_range))) / np.sqrt(2)
    for azimuth, column in points:
        reflectivity = 10 ** (peak_db / 20) * np.exp(2j * np.pi * rng.random())
        at_range = column * gate
        echo += reflectivity * np.exp(-4j * np.pi * (f - CARRIER) * at_range / SPEED_OF_LIGHT - 2j * np.pi * u * azimuth)
    echo *= np.exp(-4j * np.pi * f * displacement(u, f) / SPEED_OF_LIGHT)
    return echo * (np.abs(f - CARRIER) <= 0.4 * SAMPLING)


def image(points, displacement, n_azimuth, n_range, **scene):
    return np.fft.ifft2(spectrum(points, displacement, n_azimuth, n_range, **scene)).astype(np.complex64)
