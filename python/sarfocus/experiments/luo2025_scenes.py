"""Scenes with few, without and with many strong points, and the phase errors that defocus them [Luo2025, section 3.6].

Two kinds. *Clutter statistics*: speckle on a gamma-distributed, correlated texture (K distribution) and points. *Measured amplitude*:
crops of a Sentinel-1 excerpt; the amplitude counts as scattering coefficient, with a random phase, because the data themselves are TOPS.
Reflected copies of a crop fill the image. Both are limited to a share of the spectrum in either direction, as a focused image is.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..io import Image, read
from .crlb import smooth_phase

WAVELENGTH = 0.03125  # m, X band (9.6 GHz)
RANGE_SAMPLING = 300e6  # Hz: 0.5 m
SPEED_OF_LIGHT = 299792458.0
BANDWIDTH_RATIO = RANGE_SAMPLING * WAVELENGTH / SPEED_OF_LIGHT
AZIMUTH_SHARE, RANGE_SHARE = 0.83, 0.8  # of the spectrum that the image fills
POLYNOMIAL_PEAK = 20.0  # rad, from the middle of the aperture to its ends
ORDERS = (2, 4, 6)
SMOOTH_RMS, SMOOTH_CYCLES = 3.0, 8  # rad; cycles over the aperture
SMOOTH = "smooth"
ERRORS = (*(f"order {order}" for order in ORDERS), SMOOTH)
CLUTTER, MEASURED = "clutter statistics", "measured amplitude"
KINDS = (CLUTTER, MEASURED)
FILES = "sentinel1/*.tiff"
ComplexArray = npt.NDArray[np.complex64]
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Statistics:
    """A scene of clutter and points."""

    order: float  # of the gamma distribution of the texture: the smaller, the spikier
    correlation: float  # pixels, of the texture
    points: float  # for each 2**20 pixels
    peak_db: tuple[float, float]  # over the mean clutter, from and to


@dataclass(frozen=True)
class Crop:
    """A part of the measured excerpt, [azimuth, range] pixels."""

    azimuth: tuple[int, int]
    range: tuple[int, int]
    shows: str


FEW, NONE, MANY = "1 (few points)", "2 (no points)", "3 (many points)"
STATISTICS = {
    FEW: Statistics(order=4.0, correlation=12.0, points=12.0, peak_db=(25.0, 35.0)),
    NONE: Statistics(order=4.0, correlation=12.0, points=0.0, peak_db=(0.0, 0.0)),
    MANY: Statistics(order=2.0, correlation=12.0, points=600.0, peak_db=(20.0, 35.0)),
}
CROPS = {
    FEW: Crop((0, 130), (900, 1401), "farmland with single houses"),
    NONE: Crop((410, 601), (900, 1401), "open sea"),
    MANY: Crop((60, 250), (130, 700), "town"),
}
SCENES = tuple(STATISTICS)


@dataclass(frozen=True)
class Draw:
    """An image without error, the error, and the image under it."""

    truth: ComplexArray
    phase_error: FloatArray  # rad, over the azimuth spectrum, zero frequency in the middle
    image: ComplexArray


def excerpt(data: str | os.PathLike[str] | None) -> FloatArray | None:
    """Return the amplitude of the excerpt below the folder; None where neither `data` nor ``$SARFOCUS_DATA`` names a folder.

    Raises
    ------
    ValueError
        No such file there, or not one of that size.
    """
    named = data if data is not None else os.environ.get("SARFOCUS_DATA")
    if named is None:
        return None
    files = sorted(Path(named).glob(FILES))
    if not files:
        raise ValueError(f"data: expected {FILES} below {named}, got none")
    image = read(files[0])
    if not isinstance(image, Image):
        raise ValueError(f"data: expected an image in {files[0]}")
    needed = tuple(max(getattr(crop, axis)[1] for crop in CROPS.values()) for axis in ("azimuth", "range"))
    if image.data.shape[0] < needed[0] or image.data.shape[1] < needed[1]:
        raise ValueError(f"data: expected {needed} pixels or more in {files[0]}, got {image.data.shape}")
    return np.abs(image.data).astype(np.float64)


def coefficients(
    scene: str | Statistics, shape: tuple[int, int], amplitude: FloatArray | None, generator: np.random.Generator
) -> ComplexArray:
    """Return scattering coefficients [azimuth, range]: of the clutter statistics, or of the crop where there is a measured `amplitude`."""
    if isinstance(scene, Statistics):
        return _simulated(scene, shape, generator)
    if amplitude is None:
        return _simulated(STATISTICS[scene], shape, generator)
    crop = CROPS[scene]
    cut = amplitude[slice(*crop.azimuth), slice(*crop.range)]
    filled = np.pad(cut, [(0, max(0, size - have)) for size, have in zip(shape, cut.shape, strict=True)], mode="symmetric")
    return np.asarray(filled[: shape[0], : shape[1]] * _random_phase(shape, generator), dtype=np.complex64)


def _simulated(statistics: Statistics, shape: tuple[int, int], generator: np.random.Generator) -> ComplexArray:
    white = generator.standard_normal((2, *shape), dtype=np.float32)
    made = np.asarray(np.sqrt(0.5 * texture(statistics, shape, generator)) * (white[0] + 1j * white[1]), dtype=np.complex64)
    add_points(made, statistics, generator)
    return made


def add_points(made: ComplexArray, statistics: Statistics, generator: np.random.Generator) -> None:
    """Add the points to clutter of unit power; their levels are those after the limitation to the band."""
    count = round(statistics.points * made.size / 2**20)
    level = 10.0 ** (generator.uniform(*statistics.peak_db, count) / 20.0) / (AZIMUTH_SHARE * RANGE_SHARE) ** 0.5
    where = generator.choice(made.size, count, replace=False, shuffle=False)
    made.reshape(-1)[where] += level * _random_phase(count, generator)


def texture(statistics: Statistics, shape: tuple[int, int], generator: np.random.Generator) -> FloatArray:
    """Return a correlated texture of mean one; a gamma distribution of half-integer order is a sum of squares of Gaussian fields."""
    fields = round(2.0 * statistics.order)
    squared = np.fft.fftfreq(shape[0])[:, None] ** 2 + np.fft.fftfreq(shape[1]) ** 2
    response = np.exp(-2.0 * (np.pi * statistics.correlation) ** 2 * squared)
    response /= np.sqrt(np.mean(response**2))
    total = np.zeros(shape)
    for _ in range(fields):
        total += np.fft.ifft2(np.fft.fft2(generator.standard_normal(shape)) * response).real ** 2
    return total / fields


def _random_phase(shape: int | tuple[int, ...], generator: np.random.Generator) -> npt.NDArray[np.complex128]:
    return np.asarray(np.exp(2j * np.pi * generator.random(shape)))


def inside(n: int, share: float) -> npt.NDArray[np.bool_]:
    """Return which samples of a spectrum, zero frequency in the middle, the image fills."""
    return np.abs(np.fft.fftshift(np.fft.fftfreq(n))) <= 0.5 * share


def draw(
    scene: str | Statistics, error: str, shape: tuple[int, int], *, amplitude: FloatArray | None, generator: np.random.Generator
) -> Draw:
    """Make a scene and put an error on it."""
    spectrum = np.fft.fftshift(np.fft.fft2(coefficients(scene, shape, amplitude, generator)))
    spectrum *= inside(shape[0], AZIMUTH_SHARE)[:, None] * inside(shape[1], RANGE_SHARE)
    phase = phase_error(error, shape[0], generator)
    truth = image_of(spectrum)
    scale = np.float32(1.0 / np.sqrt(np.mean(np.abs(truth) ** 2)))
    return Draw(truth * scale, phase, image_of(spectrum * full_error(phase, shape[1])) * scale)


def image_of(spectrum: npt.NDArray[Any]) -> ComplexArray:
    """Return the image of a two-dimensional spectrum that has zero frequency in the middle."""
    image: ComplexArray = np.fft.ifft2(np.fft.ifftshift(spectrum)).astype(np.complex64)
    return image


def full_error(phase: FloatArray, n_range: int) -> npt.NDArray[np.complex64]:
    """Return exp(j (1 + f / carrier) phase) over azimuth and range frequency: what a wrong distance does, to range as well as to phase."""
    relative = np.fft.fftshift(np.fft.fftfreq(n_range)) * BANDWIDTH_RATIO
    factor: npt.NDArray[np.complex64] = np.exp(1j * phase[:, None] * (1.0 + relative)).astype(np.complex64)
    return factor


def phase_error(error: str, n: int, generator: np.random.Generator) -> FloatArray:
    """Return the phase error of that name, rad, over the azimuth spectrum, zero frequency in the middle."""
    if error == SMOOTH:
        phase = smooth_phase(n, SMOOTH_RMS, SMOOTH_CYCLES, generator)
    else:
        phase = POLYNOMIAL_PEAK * (np.fft.fftshift(np.fft.fftfreq(n)) / (0.5 * AZIMUTH_SHARE)) ** int(error.removeprefix("order "))
    return phase - line_of(phase)


def line_of(phase: FloatArray) -> FloatArray:
    """Return the constant and the line that fit the phase best over the band that the image fills: the gauge of the scores."""
    band = inside(len(phase), AZIMUTH_SHARE)
    sample = np.arange(len(phase), dtype=np.float64)
    fitted: FloatArray = np.polynomial.Polynomial.fit(sample[band], phase[band], 1)(sample)
    return fitted


def described(shape: tuple[int, int], kinds: tuple[str, ...]) -> dict[str, Any]:
    """Return the parameters of the scenes, for the parameters of an experiment."""
    out: dict[str, Any] = {
        "n_azimuth": shape[0], "n_range": shape[1], "kinds": list(kinds), "wavelength": WAVELENGTH, "range_sampling": RANGE_SAMPLING,
        "azimuth_share": AZIMUTH_SHARE, "range_share": RANGE_SHARE, "errors": list(ERRORS), "polynomial_peak": POLYNOMIAL_PEAK,
        "smooth_rms": SMOOTH_RMS, "smooth_cycles": SMOOTH_CYCLES, "injected": "exp(j (1 + range frequency / carrier) phase)",
        "clutter": {name: vars(item) for name, item in STATISTICS.items()},
    }  # fmt: skip
    if MEASURED in kinds:
        out["crops"] = {name: vars(crop) for name, crop in CROPS.items()}
    return out
