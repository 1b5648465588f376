"""Factorised backprojection at growing sizes: time, error against the exact way, memory, and the exponents of growth."""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

import sarfocus

WAVELENGTH = 299_792_458.0 / 9.6e9
PIXEL, SPACING, STANDOFF, HEIGHT = 0.4, 0.42, 5000.0, 2500.0
LARGEST_COMPARED = 1024  # with the exact sum


def peak_memory() -> float:
    """Give the largest memory that the process had so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def job(size: int) -> tuple[np.ndarray, np.ndarray, sarfocus.ImageGrid, dict[str, float]]:
    """Noise that fills 83 % of the band sampled: `size` pulses, `size` x `size` pixels."""
    rng = np.random.default_rng(3)
    x = np.linspace(-0.5, 0.5, size) * WAVELENGTH * STANDOFF / (2.5 * PIXEL)
    positions = np.c_[x, np.full(size, -np.sqrt(STANDOFF**2 - HEIGHT**2)), np.full(size, HEIGHT)]
    half = PIXEL * size / 2
    n = int((2 * (0.87 * half + half**2 / STANDOFF) + 60) / SPACING)
    data = np.empty((size, n), np.complex64)
    outside = np.abs(np.fft.fftfreq(n)) > 0.83 / 2
    fade = np.minimum(1, np.sin(np.pi * (np.arange(n) + 0.5) / n) * n / 76) ** 2
    for line in data:
        spectrum = np.fft.fft(rng.standard_normal(n) + 1j * rng.standard_normal(n))
        spectrum[outside] = 0
        line[:] = np.fft.ifft(spectrum) * fade
    grid = sarfocus.ImageGrid.plane((-half, -half, 0), (PIXEL, 0, 0), (0, PIXEL, 0), (size, size))
    return data, positions, grid, {"range_start": STANDOFF - n / 2 * SPACING, "range_spacing": SPACING, "wavelength": WAVELENGTH}


def main() -> None:
    sizes = [int(s) for s in sys.argv[1:]] or [512, 1024, 2048]
    seconds = []
    for size in sizes:
        data, positions, grid, how = job(size)
        out = np.empty((size, size), np.complex64)
        plan = sarfocus.plan_factorized(positions, grid, n_range=data.shape[1], **how)
        before = peak_memory()
        times = []
        for _ in range(3):
            start = time.perf_counter()
            sarfocus.backproject(data, positions, grid, method="ffbp", out=out, **how)
            times.append(time.perf_counter() - start)
        memory = peak_memory() - before
        seconds.append(min(times))
        text = (
            f"{size}: {seconds[-1]:.3f} s, {size**3 / seconds[-1] / 1e9:.1f} G pixel-pulses/s, predicted {plan.predicted_error_db:.1f} dB"
        )
        if size <= LARGEST_COMPARED:
            truth = sarfocus.backproject(data, positions, grid, **how)
            text += f", from the exact way {20 * np.log10(np.linalg.norm(out - truth) / np.linalg.norm(truth)):.1f} dB"
        stages = " > ".join(f"{s.rows}x{s.columns}/{s.centres}" for s in plan.stages)
        print(f"{text}; {stages}; planned {plan.memory / 2**20:.0f} MiB, peak grew by {memory:.0f}", flush=True)
    if len(sizes) > 1:
        print(f"time grows as size to the power {np.polyfit(np.log(sizes), np.log(seconds), 1)[0]:.2f} (the exact sum: 3)")


if __name__ == "__main__":
    main()
