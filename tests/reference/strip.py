"""Slow NumPy oracles of stripmap autofocus without iterations, written from the equations of Xie 2023 and of the page of methods."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from . import azimuth

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def rounded(x: Real, width: float) -> Real:
    """1 for |x| <= 1 - width, down to 0 at |x| = 1 along a raised cosine."""
    if width == 0:
        return (np.abs(x) <= 1).astype(np.float64)
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.clip((np.abs(x) - 1 + width) / width, 0, 1)))


def dechirped(
    image: NDArray[np.complexfloating],
    point: tuple[int, int],
    *,
    fields: dict[str, float],
    slant_range: float,
    bandwidth: float,
    window: float,
    taper: float,
) -> tuple[Complex, Real]:
    """[Xie2023, section 3.2, eq. 6-7]: intercept, decompress, dechirp; over the whole slow time of the strip.

    Decompression multiplies the spectrum by the conjugate of the compression filter; what is divided by is the decompressed signal of an
    ideal point in the middle of the piece, with the same taper, which is the chirp of eq. 7 as a band-limited strip holds it. Returned with
    the power of that signal.
    """
    n = len(image)
    azimuth_pixel, gate = point
    offset = np.arange(n) - azimuth_pixel
    piece = image[:, gate] * np.where(np.abs(offset) < window, rounded(offset / window, 0.25), 0)
    f = azimuth.baseband_frequency(n, fields["prf"], fields["doppler_centroid"]) - fields["doppler_centroid"]
    rate = azimuth.fm_rate(fields["wavelength"], fields["velocity"], np.array([slant_range]))[0]
    conjugate_filter = rounded(f / (bandwidth / 2), taper) * np.exp(1j * np.pi * f**2 / rate)
    signal = np.fft.ifft(np.fft.fft(piece) * conjugate_filter)
    ideal = np.fft.ifft(np.fft.fft(offset == 0) * conjugate_filter)
    power = np.abs(ideal) ** 2
    return signal * ideal.conj() / np.maximum(power, 1e-12 * power.max()), power


def contrast(line: Complex, used: NDArray[np.bool_]) -> float:
    """Q_k of the samples in use [Xie2023, eq. 5]."""
    amplitude = np.abs(line[used])
    return float(1 - amplitude.mean() ** 2 / (amplitude**2).mean())


def tone_slope(product: Complex, limit: float) -> float:
    """Where sum product exp(-j slope k) is largest, within +-limit rad a sample: a fine grid, then a search between its points."""
    k = np.arange(product.size)

    def power(slope: float) -> float:
        return float(np.abs(np.sum(product * np.exp(-1j * slope * k))) ** 2)

    grid = np.arange(-limit, limit, 0.5 / product.size)
    best = grid[np.argmax([power(s) for s in grid])]
    step = 0.5 / product.size
    found = optimize.minimize_scalar(lambda s: -power(s), bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-12})
    return float(found.x)


def slope_matrix(signals: tuple[Complex, Complex], t: Real, middle: tuple[float, float], rate: tuple[float, float], width: int) -> Real:
    """|R(i, j)| [Xie2023, eq. 9-16]: chirps dechirped about positions i - W/2 and j - W/2 pixels from their middles; slope of the phase.

    t in samples, rates in cycles per sample squared; signals over the overlap of the two apertures.
    """
    out = np.empty((width, width))
    for i in range(width):
        for j in range(width):
            reference1 = np.exp(-1j * np.pi * rate[0] * (t - middle[0] - (i - width // 2)) ** 2)
            reference2 = np.exp(-1j * np.pi * rate[1] * (t - middle[1] - (j - width // 2)) ** 2)
            product = signals[0] * reference1.conj() * (signals[1] * reference2.conj()).conj()
            out[i, j] = abs(np.angle(np.sum(product[1:] * product[:-1].conj())))
    return out


def stitched(first: NDArray[np.int64], second: NDArray[np.int64], slope: Real, deviation: Real, points: int) -> Real:
    """Weighted least squares for b_n over slope = b_first - b_second, zero on average [methods 3, joint stitching], one segment."""
    matrix = np.zeros((slope.size + 1, points))
    matrix[np.arange(slope.size), first] = 1 / deviation
    matrix[np.arange(slope.size), second] = -1 / deviation
    matrix[-1] = 1
    return np.asarray(np.linalg.lstsq(matrix, np.append(slope / deviation, 0), rcond=None)[0])


def summed_gradient(lines: list[Complex], starts: list[int], slopes: Real, n: int) -> Real:
    """phi(k) = sum of arg sum_n d_n(k) conj(d_n(k - 1)) exp(-j b_n), from the first sample reached on [methods 3; Xie2023, eq. 22]."""
    step = np.zeros(n, np.complex128)
    for line, start, slope in zip(lines, starts, slopes, strict=True):
        power = np.mean(np.abs(line) ** 2)
        step[start + 1 : start + line.size] += line[1:] * line[:-1].conj() * np.exp(-1j * slope) / power
    return np.cumsum(np.where(step == 0, 0, np.angle(step)))


class Aperture(NamedTuple):
    """A line and what is known of it: samples, weights, slow times, slow time of the point, power of the signal, of noise at weight 1."""

    line: Complex
    weight: Real
    k: NDArray[np.int64]
    middle: int
    signal: float
    noise: float


def posterior_phase(apertures: list[Aperture], roughness: float, begin: Real) -> Real:
    """Most likely phase given amplitudes and noise of the lines, by plain Gauss-Newton over phase, constants and slopes at once.

    Line n: A_n exp(j (phi(k) + a_n + b_n (k - middle_n))) plus white noise of power noise_n / w(k); phi has independent second differences
    of standard deviation `roughness` [methods 3, joint maximum likelihood]. Constant and line of phi are left open.
    """
    n, count = begin.size, len(apertures)
    curvature = np.diff(np.eye(n), 2, axis=0) / roughness

    def turned(x: Real) -> list[Complex]:
        """What every line would be without noise, in units of the noise of real and imaginary part."""
        return [
            np.sqrt(2 * a.weight * a.signal / a.noise) * np.exp(1j * (x[a.k] + x[n + p] + x[n + count + p] * (a.k - a.middle)))
            for p, a in enumerate(apertures)
        ]

    def residual(x: Real) -> Real:
        misfit = np.concatenate([np.sqrt(2 * a.weight / a.noise) * a.line - model for a, model in zip(apertures, turned(x), strict=True)])
        return np.concatenate([misfit.real, misfit.imag, curvature @ x[:n]])

    def jacobian(x: Real) -> Real:
        rows = []
        for p, (a, model) in enumerate(zip(apertures, turned(x), strict=True)):
            row = np.zeros((a.k.size, x.size), np.complex128)
            row[np.arange(a.k.size), a.k] = row[:, n + p] = -1j * model
            row[:, n + count + p] = -1j * model * (a.k - a.middle)
            rows.append(row)
        stacked = np.concatenate(rows)
        return np.concatenate([stacked.real, stacked.imag, np.pad(curvature, ((0, 0), (0, 2 * count)))])

    constants = [np.angle(np.sum(a.weight * a.line * np.exp(-1j * begin[a.k]))) for a in apertures]
    # Gauss-Newton on the dense system; the open constants and slopes take the shortest step.
    x = np.concatenate([begin, constants, np.zeros(count)])
    for _ in range(10):
        slope = jacobian(x)
        x = x + np.linalg.pinv(slope.T @ slope, rcond=1e-10, hermitian=True) @ (slope.T @ -residual(x))
    return np.asarray(x[:n])


def without_line(phase: Real) -> Real:
    """The phase less its constant and line, the gauge of [methods 0]."""
    k = np.arange(phase.size)
    found = np.isfinite(phase)
    return np.asarray(phase - np.polyval(np.polyfit(k[found], phase[found], 1), k))
