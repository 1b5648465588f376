"""Four channels whose platform leaves its height by an error of its own in every pulse [Zhou2022, section 4.1; methods.md, section 5].

The points at 50, 60 and 70 km are seen by the same pulses: as many as give a Doppler bandwidth of 1900 Hz at 50 km. (Under a beam of fixed
width a farther point is also seen by pulses that see no nearer one, which then can't tell their motion.)
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .. import ImageGrid, backproject, quality, simulate
from ..hrws import Echo

C = 299_792_458.0
WAVELENGTH = C / 9.6e9
BANDWIDTH = 150e6
RANGE_SAMPLING = 200e6  # Hz; misprinted in the paper
PRF = 700.0
DOPPLER_BANDWIDTH = 1900.0
HEIGHT = 20e3
VELOCITY = 1900.0
CHANNELS = np.array([[0.0, d, 0.0] for d in range(4)])  # m; the first transmits
GROUND_RANGES = (50e3, 60e3, 70e3)
N_PULSE = 310  # those that see a point at 50 km within the Doppler bandwidth
N_RANGE = 384  # of the swath about a single point
SHAPE = (256, 64)  # of the chip about a point
STEP = (0.5, 0.5)  # m, azimuth and ground range
AMBIGUITY_ROWS = 96  # of the chips about its ambiguities
AMBIGUITIES = (-2, -1, 1, 2)
FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex64]


def height_error(seed: int, n_pulse: int = N_PULSE) -> FloatArray:
    """Height error of every pulse, m: white, uniform within half a wavelength either way."""
    motion = np.zeros((n_pulse, 3))
    motion[:, 2] = np.random.default_rng(seed).uniform(-0.5, 0.5, n_pulse) * WAVELENGTH
    return motion


def track(n_pulse: int = N_PULSE) -> FloatArray:
    """Return the platform without motion error, m: along y, at `HEIGHT` above the points' plane."""
    along = (np.arange(n_pulse) - 0.5 * (n_pulse - 1)) * VELOCITY / PRF
    return np.stack([np.zeros(n_pulse), along, np.full(n_pulse, HEIGHT)], axis=1)


def simulated(ground_ranges: tuple[float, ...], motion: FloatArray, threads: int = 0, **options: Any) -> Echo:
    """Echo of points at (ground range, 0, 0) over the swath that they span; options as of `simulate.hrws`."""
    spacing = C / (2.0 * RANGE_SAMPLING)
    slant = [float(np.hypot(x, HEIGHT)) for x in ground_ranges]
    given: dict[str, Any] = {"motion": motion, "threads": threads} | options
    return simulate.hrws(
        track(len(motion)),
        CHANNELS,
        [[x, 0.0, 0.0] for x in ground_ranges],
        np.ones(len(ground_ranges)),
        n_range=N_RANGE + int((max(slant) - min(slant)) / spacing),
        range_start=min(slant) - 0.5 * spacing * N_RANGE,
        range_spacing=spacing,
        wavelength=WAVELENGTH,
        bandwidth=BANDWIDTH,
        prf=PRF,
        **given,
    )


def chip(ground_range: float, along: float, shape: tuple[int, int]) -> ImageGrid:
    """Pixels about (ground_range, along, 0), which is pixel (shape[0] // 2, shape[1] // 2)."""
    origin = (ground_range - shape[1] // 2 * STEP[1], along - shape[0] // 2 * STEP[0], 0.0)
    return ImageGrid.plane(origin, (0.0, STEP[0], 0.0), (STEP[1], 0.0, 0.0), shape)


def stacked(ground_range: float) -> FloatArray:
    """Positions of the chip about a point and of those about its ambiguities, one below the other: [n, SHAPE[1], 3], m."""
    chips = [chip(ground_range, 0.0, SHAPE)]
    chips += [chip(ground_range, k * ambiguity_offset(ground_range), (AMBIGUITY_ROWS, SHAPE[1])) for k in AMBIGUITIES]
    return np.concatenate([one.positions() for one in chips])


def ambiguity_offset(ground_range: float) -> float:
    """Return how far along the track the first ambiguity lies, m."""
    slant_range = float(np.hypot(ground_range, HEIGHT))
    samples = quality.azimuth_ambiguity_offset(prf=PRF, wavelength=WAVELENGTH, velocity=VELOCITY, slant_range=slant_range)
    return samples * VELOCITY / PRF


def plain(echo: Echo, grid: ImageGrid, motion: FloatArray | None, threads: int = 0) -> npt.NDArray[np.complex64]:
    """Backproject the samples of all channels as if they were evenly spaced."""
    total = np.zeros(grid.shape, np.complex64)
    for channel, samples in enumerate(echo.data):
        centres = echo.phase_centres[channel] + (0.0 if motion is None else motion)
        half = 0.5 * echo.baselines[channel] if echo.baselines is not None else np.zeros(3)
        total += backproject(
            samples,
            (centres - half, centres + half),
            grid,
            range_start=echo.range_start,
            range_spacing=echo.range_spacing,
            wavelength=echo.wavelength,
            threads=threads,
        )
    return total


def figures(image: ComplexArray, ground_range: float, aperture: float) -> dict[str, Any]:
    """Measure the brightest point of the first chip of `stacked`, seen over an aperture (m), and its highest azimuth ambiguity."""
    about = image[: SHAPE[0]]
    at = np.unravel_index(int(np.argmax(np.abs(about))), about.shape)
    slant_range = float(np.hypot(ground_range, HEIGHT))
    resolution = 0.5 * WAVELENGTH * slant_range / aperture
    cells = (resolution / STEP[0], C / (2.0 * BANDWIDTH) / (STEP[1] * ground_range / slant_range))
    found = quality.point_response(about, (int(at[0]), int(at[1])), oversampling=cells)
    ambiguities = np.abs(image[SHAPE[0] :]).reshape(len(AMBIGUITIES), -1).max(axis=1)
    relative = 20.0 * np.log10(ambiguities / found.amplitude)
    return {
        "shift": (found.azimuth.position - SHAPE[0] // 2) * STEP[0],
        "irw_cells": found.azimuth.irw_cells,
        "pslr_db": found.azimuth.pslr_db,
        "islr_db": found.azimuth.islr_db,
        "ambiguity_db": float(relative.max()),
    }
