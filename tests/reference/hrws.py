"""Slow NumPy oracles of the multichannel reconstruction, written from the equations [methods.md, section 5; Zhou2022, eq. 1, 11-16]."""

import numpy as np
from numpy.typing import NDArray

C = 299_792_458.0


def yen_weights(f: float, offsets: NDArray[np.float64], prf: float, velocity: float) -> NDArray[np.complex128]:
    """w_n = N c_n exp(j 2 pi f o_n / v), sum over n of c_n exp(j 2 pi f_m o_n / v) = [f_m = f], f_m the N bands about zero [methods, 5]."""
    n = len(offsets)
    m = np.arange(-n, n + 1)
    aliased = f + m * prf
    aliased = aliased[(aliased >= -n * prf / 2) & (aliased < n * prf / 2)]
    equations = np.exp(2j * np.pi * np.outer(aliased, offsets) / velocity)
    c = np.linalg.solve(equations, np.isclose(aliased, f).astype(float))
    return n * c * np.exp(2j * np.pi * f * offsets / velocity)


def ranges(centres: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances, m: [..., n_point] for centres [..., 3]."""
    return np.linalg.norm(points - centres[..., None, :], axis=-1)


def point_terms(
    centres: NDArray[np.float64], target: NDArray[np.float64], points: NDArray[np.float64], *, wavelength: float, bandwidth: float
) -> NDArray[np.complex128]:
    """Terms of backprojection of a unit scatterer's exact echo (no interpolation): [..., n_point] for centres [..., 3]."""
    difference = ranges(centres, points) - ranges(centres, target[None])
    return np.sinc(2 * bandwidth * difference / C) * np.exp(4j * np.pi * difference / wavelength)


def local_doppler(
    centres: NDArray[np.float64], points: NDArray[np.float64], direction: NDArray[np.float64], *, wavelength: float, velocity: float
) -> NDArray[np.float64]:
    """f = 2 v (y - y_epc) / (lambda R), y along the direction of flight [methods, 5]."""
    along = (points - centres[..., None, :]) @ direction
    return 2 * velocity * along / (wavelength * ranges(centres, points))


def sub_image(
    terms: NDArray[np.complex128],
    psi: NDArray[np.complex128],
    ideal: NDArray[np.float64],
    even: NDArray[np.float64],
    *,
    wavelength: float,
) -> NDArray[np.complex128]:
    """Eq. 12, 13 and 16, sub-image by sub-image.

    terms [n_channel, n_pulse, n_point]: samples along the range history with motion times exp(+4j pi R / lambda) of it; psi [n_even,
    2 L + 1, n_channel]; ideal [n_channel, n_pulse, n_point], even [n_even, n_pulse, n_point]: ranges from the straight line to the points,
    m, at the places of the samples and of the evenly spaced ones.
    """
    n_even, width, n_channel = psi.shape
    half = width // 2
    n_pulse = terms.shape[1]
    corrected = terms * np.exp(-4j * np.pi * ideal / wavelength)
    total = np.zeros(terms.shape[2], np.complex128)
    for i in range(n_even):
        for lag in range(-half, half + 1):
            for n in range(n_channel):
                k = np.arange(max(0, -lag), min(n_pulse, n_pulse - lag))
                sub = (corrected[n, k + lag] * np.exp(4j * np.pi * even[i, k] / wavelength)).sum(axis=0)
                total += psi[i, lag + half, n] * sub
    return total


def visible(
    positions: NDArray[np.float64],
    middle: NDArray[np.float64],
    target: NDArray[np.float64],
    *,
    prf: float,
    wavelength: float,
    bandwidth: float,
) -> NDArray[np.bool_]:
    """Pulses whose platform, moved to the middle of the channels, sees the target within half the bandwidth of zero Doppler."""
    velocity = np.gradient(positions, axis=0) * prf
    sight = target - positions - middle
    f = 2 * (velocity * sight).sum(axis=1) / (wavelength * np.linalg.norm(sight, axis=1))
    return np.abs(f) <= bandwidth / 2
