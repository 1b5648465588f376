"""The job of the side-by-side comparison of backprojection, as files that any interpreter with NumPy reads.

X band, 300 MHz, 5 km standoff: noise in range and pulse, its spectrum flat over the band, and the sum in double precision at random pixels.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

SPEED_OF_LIGHT = 299_792_458.0
CARRIER = 9.6e9
BANDWIDTH = 300e6
STANDOFF, HEIGHT = 5000.0, 2500.0
PIXEL = 0.4
CHECKED = 20_000


def profiles_of(spectrum: np.ndarray, length: int) -> np.ndarray:
    """Range profiles of `length` samples over the same swath, sample length // 2 at the reference range."""
    n = spectrum.shape[-1]
    padded = np.zeros((*spectrum.shape[:-1], length), np.complex128)
    padded[..., length // 2 - n // 2 : length // 2 - n // 2 + n] = spectrum
    return np.fft.fftshift(np.fft.ifft(np.fft.ifftshift(padded, axes=-1), axis=-1), axes=-1) * length


def exact(spectrum: np.ndarray, positions: np.ndarray, reference: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Sum over pulses in double precision: profiles sampled 64 times as densely, cubic between them (-130 dB)."""
    n, dense = spectrum.shape[1], 64 * spectrum.shape[1]
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


def write(folder: Path, size: int) -> None:
    """`size` x `size` pixels, `size` pulses."""
    rng = np.random.default_rng(2)
    length = SPEED_OF_LIGHT / CARRIER * STANDOFF / (2 * 1.25 * PIXEL)
    x = np.linspace(-0.5, 0.5, size) * length
    positions = np.c_[x, np.full(size, -np.sqrt(STANDOFF**2 - HEIGHT**2)), np.full(size, HEIGHT)]
    reference = np.linalg.norm(positions, axis=1)
    half = PIXEL * size / 2
    swath = 2 * (0.87 * half + half**2 / STANDOFF + 30)
    n = int(np.ceil(swath / (SPEED_OF_LIGHT / (2 * BANDWIDTH))))
    fade = np.minimum(1, np.sin(np.pi * (np.arange(n) + 0.5) / n) * n / 76) ** 2
    noise = rng.standard_normal((size, 2 * n), dtype=np.float32).view(np.complex64) * fade
    spectrum = np.fft.fftshift(np.fft.fft(np.fft.ifftshift(noise, axes=1), axis=1), axes=1).astype(np.complex64)
    dense = int(np.ceil(1.2 * n))
    data = profiles_of(spectrum, dense) * np.exp(-2j * np.pi * np.remainder(2 * CARRIER / SPEED_OF_LIGHT * reference, 1.0))[:, None]
    spacing = SPEED_OF_LIGHT / (2 * BANDWIDTH) * n / dense
    pixels = rng.integers(0, size, (CHECKED, 2))
    points = np.c_[(pixels - size // 2) * PIXEL, np.zeros(CHECKED)]
    np.savez(
        folder / "job.npz",
        data=data.astype(np.complex64),
        spectrum=spectrum,
        positions=positions,
        reference=reference,
        start=reference - dense // 2 * spacing,
        spacing=spacing,
        first_frequency=CARRIER - n // 2 * BANDWIDTH / n,
        frequency_step=BANDWIDTH / n,
        pixel=PIXEL,
        pixels=pixels,
        truth=exact(spectrum, positions, reference, points),
        wavelength=SPEED_OF_LIGHT / CARRIER,
    )


if __name__ == "__main__":
    write(Path(sys.argv[1]), int(sys.argv[2]))
