"""Short timings of the kernels, each with its error beside it, so that speed can't be bought with quality."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from . import ImageGrid, StripmapGeometry, azimuth_compress, azimuth_decompress, backproject, estimate_phase
from .experiments import crlb

Progress = Callable[[str, int, int], None] | None
REPEATS = 3
SEED = 7


def run(*, threads: int = 0, progress: Progress = None) -> list[dict[str, Any]]:
    """Return one row for each kernel: problem, seconds (best of three), rate, error and what the error is."""
    rows = []
    kernels = (_backproject, _azimuth, _estimate)
    for number, kernel in enumerate(kernels, start=1):
        rows.append(kernel(threads))
        if progress is not None:
            progress("bench", number, len(kernels))
    return rows


def best(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the shortest of a few times, s, and the value."""
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        value = function()
        times.append(time.perf_counter() - started)
    return min(times), value


def relative_db(value: npt.NDArray[Any], truth: npt.NDArray[Any]) -> float:
    """Return the energy of the difference over the energy of the truth, dB."""
    return float(20.0 * np.log10(np.linalg.norm(value - truth) / np.linalg.norm(truth)))


def _backproject(threads: int) -> dict[str, Any]:
    n_pulse, n_range, wavelength, spacing = 256, 256, 0.03, 0.5
    generator = np.random.default_rng(SEED)
    track = np.stack([np.full(n_pulse, -1000.0), np.linspace(-40.0, 40.0, n_pulse), np.full(n_pulse, 500.0)], axis=1)
    start = float(np.hypot(1000.0, 500.0)) - 0.5 * n_range * spacing
    target = np.array([3.0, -2.0, 0.0])
    distance = np.linalg.norm(track - target, axis=1)[:, None]
    ranges = start + spacing * np.arange(n_range)
    data = (np.sinc((ranges - distance) / (1.25 * spacing)) * np.exp(-4j * np.pi * distance / wavelength)).astype(np.complex64)
    grid = ImageGrid.plane((-25.0, -25.0, 0.0), (0.0, 0.1, 0.0), (0.1, 0.0, 0.0), (512, 512))
    seconds, image = best(
        lambda: backproject(data, track, grid, range_start=start, range_spacing=spacing, wavelength=wavelength, threads=threads)
    )
    rows, columns = generator.integers(180, 330, 64), generator.integers(230, 330, 64)
    truth = np.array([_response_sum(track, target, grid.position(i, j), spacing, wavelength) for i, j in zip(rows, columns, strict=True)])
    return {
        "kernel": "backproject, exact",
        "problem": f"{grid.shape[0]} x {grid.shape[1]} pixels, {n_pulse} pulses",
        "seconds": seconds,
        "rate": f"{grid.shape[0] * grid.shape[1] * n_pulse / seconds * 1e-6:.0f} M pixel pulses/s",
        "error": f"{relative_db(image[rows, columns], truth):.1f} dB",
        "against": "float64 sum, analytic pulse response",
    }


def _response_sum(track: npt.NDArray[Any], target: npt.NDArray[Any], pixel: Any, spacing: float, wavelength: float) -> complex:
    """Return the backprojection sum of one target at one pixel, with the pulse response taken from its formula."""
    difference = np.linalg.norm(track - np.asarray(pixel), axis=1) - np.linalg.norm(track - target, axis=1)
    return complex(np.sum(np.sinc(difference / (1.25 * spacing)) * np.exp(4j * np.pi * difference / wavelength)))


def _azimuth(threads: int) -> dict[str, Any]:
    shape = (2048, 512)
    generator = np.random.default_rng(SEED)
    image = (generator.standard_normal(shape) + 1j * generator.standard_normal(shape)).astype(np.complex64)
    geometry = StripmapGeometry(
        wavelength=0.03, prf=600.0, velocity=120.0, slant_range=5000.0 + 0.5 * np.arange(shape[1]), doppler_bandwidth=400.0
    )
    seconds, back = best(lambda: azimuth_compress(azimuth_decompress(image, geometry, threads=threads), geometry, threads=threads))
    return {
        "kernel": "azimuth decompress + compress",
        "problem": f"{shape[0]} x {shape[1]}",
        "seconds": seconds,
        "rate": f"{2 * image.size / seconds * 1e-6:.0f} M samples/s",
        "error": f"{relative_db(back, image):.1f} dB",
        "against": "the input",
    }


def _estimate(threads: int) -> dict[str, Any]:
    generator = np.random.default_rng(SEED)
    lines, truth = crlb.trial(10.0, generator)
    seconds, estimate = best(lambda: estimate_phase(lines, threads=threads))
    rmse = float(np.sqrt(np.mean(crlb.without_line(np.asarray(estimate.phase) - truth) ** 2)))
    return {
        "kernel": "phase estimate, maximum likelihood",
        "problem": f"{lines.shape[0]} lines of {lines.shape[1]} pulses, 10 dB",
        "seconds": seconds,
        "rate": f"{lines.size / seconds * 1e-6:.1f} M samples/s",
        "error": f"{rmse:.4f} rad",
        "against": f"the true phase; Cramer-Rao bound {crlb.bound(10.0):.4f} rad",
    }
