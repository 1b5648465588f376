"""What the stripmap experiments have in common: an airborne X-band strip, its phase errors, and how estimates are compared with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .. import StripmapGeometry

WAVELENGTH = 0.03125  # m, X band (9.6 GHz)
VELOCITY = 120.0  # m/s
PRF = 360.0  # Hz
DOPPLER_BANDWIDTH = 300.0  # Hz: 0.4 m of azimuth resolution
FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex64]


def airborne(n_range: int, range_start: float, range_spacing: float, **changes: float) -> StripmapGeometry:
    """Return an airborne X-band collection; the FM rate of its range gates falls with range as it does in reality."""
    fields = {"wavelength": WAVELENGTH, "prf": PRF, "velocity": VELOCITY, "doppler_bandwidth": DOPPLER_BANDWIDTH} | changes
    return StripmapGeometry(**fields, slant_range=range_start + range_spacing * np.arange(n_range))


def described(geometry: StripmapGeometry) -> dict[str, Any]:
    """Return the parameters of a collection, for the parameters of an experiment."""
    slant_range = np.asarray(geometry.slant_range)
    names = ("wavelength", "velocity", "prf", "doppler_bandwidth", "doppler_centroid")
    return {name: float(getattr(geometry, name)) for name in names} | {
        "slant_range": [float(slant_range[0]), float(slant_range[-1])],
        "range_spacing": float(slant_range[1] - slant_range[0]),
        "fm_rate": [geometry.fm_rate(0), geometry.fm_rate(len(slant_range) - 1)],
        "aperture_samples": [geometry.aperture_samples(0), geometry.aperture_samples(len(slant_range) - 1)],
    }


def slope_of_shift(geometry: StripmapGeometry, shift: float, range_gate: int) -> float:
    """Return the slope of the phase error, rad a sample, that displaces a point of the gate by `shift` pixels [Xie2023, eq. 4]."""
    return 2.0 * np.pi * geometry.fm_rate(range_gate) / geometry.prf**2 * shift


def piecewise_linear(n_azimuth: int, ends: npt.ArrayLike, slopes: npt.ArrayLike) -> FloatArray:
    """Return a continuous phase, rad, with the n-th of `slopes` (rad a sample) up to sample `ends[n]`, the last one up to the end."""
    piece = np.searchsorted(np.asarray(ends), np.arange(n_azimuth), side="right")
    phase: FloatArray = np.cumsum(np.asarray(slopes, dtype=np.float64)[piece])
    return phase


def aligned(estimate: FloatArray, truth: FloatArray, where: npt.NDArray[np.bool_]) -> FloatArray:
    """Return the estimate in the gauge of the truth: without the constant and the line that fit their difference best on `where`."""
    sample = np.arange(len(truth), dtype=np.float64)
    line = np.polynomial.Polynomial.fit(sample[where], (estimate - truth)[where], 1)
    moved: FloatArray = estimate - line(sample)
    return moved
