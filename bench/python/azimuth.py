"""Azimuth compression through the bindings: time, error and peak memory; for scale, the same equation in NumPy."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable

import numpy as np

import sarfocus

ROUNDS = 7


def best_of(call: Callable[[], object]) -> float:
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def peak_memory() -> float:
    """Give the largest memory that the process had so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def numpy_compress(raw: np.ndarray, geometry: sarfocus.StripmapGeometry) -> np.ndarray:
    """Transform, multiply by exp(-j pi f^2 / K) of the range gate, transform back [docs/conventions.md]."""
    f = np.fft.fftfreq(raw.shape[0], 1 / geometry.prf)
    rate = np.array([geometry.fm_rate(i) for i in range(raw.shape[1])])
    return np.fft.ifft(np.fft.fft(raw, axis=0) * np.exp(-1j * np.pi * f[:, None] ** 2 / rate), axis=0).astype(np.complex64)


def main() -> None:
    shape = (8192, 512)
    geometry = sarfocus.StripmapGeometry(
        wavelength=0.031, prf=1000.0, velocity=100.0, slant_range=1000.0 + 0.5 * np.arange(shape[1]), doppler_bandwidth=800.0
    )
    rng = np.random.default_rng(1)
    raw = rng.standard_normal((shape[0], 2 * shape[1]), dtype=np.float32).view(np.complex64)
    before = peak_memory()
    image = sarfocus.azimuth_compress(raw, geometry)
    memory = peak_memory() - before
    out = np.empty_like(raw)
    ours = best_of(lambda: sarfocus.azimuth_compress(raw, geometry, out=out))
    theirs = best_of(lambda: numpy_compress(raw, geometry))
    expected = numpy_compress(raw, geometry)
    error = 20 * np.log10(np.linalg.norm(image - expected) / np.linalg.norm(expected))
    print(f"azimuth_compress {shape[0]} x {shape[1]}: {1e3 * ours:.1f} ms, NumPy {1e3 * theirs:.1f} ms ({theirs / ours:.1f} times)")
    print(f"difference from NumPy {error:.1f} dB; peak memory {memory:.0f} MiB, the image {image.nbytes / 2**20:.0f}")


if __name__ == "__main__":
    main()
