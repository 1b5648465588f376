"""The job of the side-by-side comparison of backprojection, as files that any interpreter with NumPy reads.

X band, 300 MHz: noise in range and pulse, its spectrum flat over the band, and the sum in double precision at random pixels of
a plane and at random points of hilly terrain about it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

SPEED_OF_LIGHT = 299_792_458.0
CARRIER = 9.6e9
BANDWIDTH = 300e6
PIXEL = 0.4
CHECKED = 4_000
DENSE = 32
HILLS = 10.0  # m, standard deviation of the terrain's heights
HILL_LENGTH = 40.0  # m, of their correlation


def profiles_of(spectrum: np.ndarray, length: int) -> np.ndarray:
    """Range profiles of `length` samples over the same swath, sample length // 2 at the reference range."""
    n = spectrum.shape[-1]
    padded = np.zeros((*spectrum.shape[:-1], length), np.complex128)
    padded[..., length // 2 - n // 2 : length // 2 - n // 2 + n] = spectrum
    return np.fft.fftshift(np.fft.ifft(np.fft.ifftshift(padded, axes=-1), axis=-1), axes=-1) * length


def exact(spectrum: np.ndarray, positions: np.ndarray, reference: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Sum over pulses in double precision: profiles sampled 32 times as densely, cubic between them (-110 dB)."""
    n, dense = spectrum.shape[1], DENSE * spectrum.shape[1]
    cell = SPEED_OF_LIGHT / (2 * BANDWIDTH) * n / dense
    total = np.zeros(len(points), np.complex128)
    for pulse, position in enumerate(positions):
        profile = profiles_of(spectrum[pulse].astype(np.complex128), dense)
        r = np.linalg.norm(points - position, axis=1) - reference[pulse]
        place = r / cell + dense // 2
        whole = np.floor(place).astype(int)
        x = place - whole
        a, b, c, d = (profile[(whole + k) % dense] for k in (-1, 0, 1, 2))
        value = b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 4 * c - d + x * (3 * (b - c) + d - a)))
        total += value * np.exp(2j * np.pi * np.remainder(2 * CARRIER / SPEED_OF_LIGHT * r, 1.0))
    return total


def terrain(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Heights of a smooth random surface, m."""
    frequency = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :]) / PIXEL
    spectrum = np.fft.rfft2(rng.standard_normal(shape)) * np.exp(-((np.pi * frequency * HILL_LENGTH) ** 2) / 2)
    heights = np.fft.irfft2(spectrum, shape)
    return heights * (HILLS / heights.std())


def collection(shape: tuple[int, int], standoff: float) -> dict[str, Any]:
    """Where the antenna is and which frequencies and ranges are sampled; the middle of the track is `standoff` from that of the scene."""
    rows, columns = shape
    height = 0.5 * standoff
    length = SPEED_OF_LIGHT / CARRIER * standoff / (2 * 1.25 * PIXEL)
    positions = np.c_[np.linspace(-0.5, 0.5, rows) * length, np.full(rows, -np.sqrt(standoff**2 - height**2)), np.full(rows, height)]
    reference = np.linalg.norm(positions, axis=1)
    along, across = PIXEL * rows / 2, PIXEL * columns / 2
    swath = 2 * (0.87 * across + max(along, across) ** 2 / standoff + 30)
    n_frequency = int(np.ceil(swath / (SPEED_OF_LIGHT / (2 * BANDWIDTH))))
    n_range = int(np.ceil(1.2 * n_frequency))
    spacing = SPEED_OF_LIGHT / (2 * BANDWIDTH) * n_frequency / n_range
    return {
        "shape": shape,
        "positions": positions,
        "reference": reference,
        "first_frequency": CARRIER - n_frequency // 2 * BANDWIDTH / n_frequency,
        "frequency_step": BANDWIDTH / n_frequency,
        "n_frequency": n_frequency,
        "n_range": n_range,
        "range_start": reference - n_range // 2 * spacing,
        "range_spacing": spacing,
        "wavelength": SPEED_OF_LIGHT / CARRIER,
    }


def write(folder: Path, shape: tuple[int, int], standoff: float) -> None:
    """An image of `shape`, as many pulses as it has azimuth lines."""
    rows, columns = shape
    rng = np.random.default_rng(2)
    place = collection(shape, standoff)
    positions, reference = place["positions"], place["reference"]
    n, dense = place["n_frequency"], place["n_range"]
    fade = np.minimum(1, np.sin(np.pi * (np.arange(n) + 0.5) / n) * n / 76) ** 2
    noise = rng.standard_normal((rows, 2 * n), dtype=np.float32).view(np.complex64) * fade.astype(np.float32)
    spectrum = np.fft.fftshift(np.fft.fft(np.fft.ifftshift(noise, axes=1), axis=1), axes=1).astype(np.complex64)
    carrier = np.exp(-2j * np.pi * np.remainder(2 * CARRIER / SPEED_OF_LIGHT * reference, 1.0))
    data = np.empty((rows, dense), np.complex64)
    for pulse in range(rows):
        data[pulse] = profiles_of(spectrum[pulse], dense) * carrier[pulse]
    pixels = np.c_[rng.integers(0, rows, CHECKED), rng.integers(0, columns, CHECKED)]
    heights = terrain(shape, rng)
    plane = np.c_[(pixels - (rows // 2, columns // 2)) * PIXEL, np.zeros(CHECKED)]
    hilly = np.c_[plane[:, :2], heights[tuple(pixels.T)]]
    truth = exact(spectrum, positions, reference, np.r_[plane, hilly])
    np.savez(
        folder / "job.npz",
        data=data,
        spectrum=spectrum,
        pixels=pixels,
        heights=heights,
        truth_plane=truth[:CHECKED],
        truth_points=truth[CHECKED:],
        **place,
    )


def read(folder: Path) -> dict[str, Any]:
    with np.load(folder / "job.npz") as stored:
        return dict(stored)


def options(job: dict[str, Any]) -> dict[str, Any]:
    """Where the samples are, as sarfocus.backproject wants to know it."""
    return {"range_start": job["range_start"], "range_spacing": float(job["range_spacing"]), "wavelength": float(job["wavelength"])}


def grid(job: dict[str, Any], over: str) -> Any:
    """The plane or the points as sarfocus has them."""
    import sarfocus  # noqa: PLC0415  the module is read where there is none, too

    rows, columns = (int(extent) for extent in job["shape"])
    x, y = ((np.arange(extent) - extent // 2) * PIXEL for extent in (rows, columns))
    if over == "points":
        return sarfocus.ImageGrid.from_points(np.stack([*np.meshgrid(x, y, indexing="ij"), job["heights"]], axis=-1))
    return sarfocus.ImageGrid.plane((x[0], y[0], 0.0), (PIXEL, 0.0, 0.0), (0.0, PIXEL, 0.0), (rows, columns))
