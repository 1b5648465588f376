"""Four channels with a height error in every pulse, imaged with the true motion [Zhou2022, section 4.1; methods.md, section 5].

The height error is drawn from +-0.5 wavelength. Each of the points at 50, 60 and 70 km is imaged from its own part of the swath, with plain
backprojection of the unevenly spaced samples beside the reconstructions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import ImageGrid, backproject, hrws, quality, simulate
from ..hrws import Echo
from .model import Reproduction, at_most

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
N_PULSE, N_RANGE = 480, 384
SHAPE = (256, 64)  # of the chip about a point
STEP = (0.5, 0.5)  # m, azimuth and ground range
AMBIGUITY_SHAPE = (97, 49)  # of the chips about its ambiguities
AMBIGUITIES = (-2, -1, 1, 2)
SEED = 20220221
TOLERANCE_DB = 0.05
AMBIGUITY_DB = -60.0
METHODS = ("plain", "folded")
FloatArray = npt.NDArray[np.float64]


def run(*, seed: int = SEED, threads: int = 0, progress: Callable[[str, int, int], None] | None = None) -> Reproduction:
    """Image the three points with the true motion."""
    motion = height_error(seed)
    rows: list[dict[str, Any]] = []
    for ground_range in GROUND_RANGES:
        echo = simulated(ground_range, motion, threads)
        for method in METHODS:
            rows.append({"method": method, "case": f"{ground_range / 1e3:g} km"} | figures(echo, method, ground_range, motion, threads))
            if progress is not None:
                progress("zhou2022", len(rows), len(GROUND_RANGES) * len(METHODS))
    weights = hrws.channel_weights(echo, doppler_bandwidth=DOPPLER_BANDWIDTH)
    parameters = {
        "wavelength": WAVELENGTH,
        "bandwidth": BANDWIDTH,
        "range_sampling": RANGE_SAMPLING,
        "prf": PRF,
        "doppler_bandwidth": DOPPLER_BANDWIDTH,
        "height": HEIGHT,
        "velocity": VELOCITY,
        "channels": CHANNELS.tolist(),
        "n_pulse": N_PULSE,
        "seed": seed,
        "condition_number": weights.condition_number,
        "noise_amplification": weights.noise_amplification,
    }
    return Reproduction(name="zhou2022-truth", parameters=parameters, rows=rows, required=requirements(rows))


def requirements(rows: list[dict[str, Any]]) -> list[Any]:
    """Return the bounds on the reconstructed points."""
    out = []
    for row in rows:
        if row["method"] == "plain":
            continue
        what = f"{row['method']}, {row['case']}: "
        out.append(at_most(what + "PSLR off a sinc's, dB", abs(row["pslr_db"] - row["theory_pslr_db"]), TOLERANCE_DB))
        out.append(at_most(what + "ISLR off a sinc's, dB", abs(row["islr_db"] - row["theory_islr_db"]), TOLERANCE_DB))
        out.append(at_most(what + "highest azimuth ambiguity, dB", row["ambiguity_db"], AMBIGUITY_DB))
    return out


def height_error(seed: int) -> FloatArray:
    """Height error of every pulse, m: white, uniform within half a wavelength either way."""
    motion = np.zeros((N_PULSE, 3))
    motion[:, 2] = np.random.default_rng(seed).uniform(-0.5, 0.5, N_PULSE) * WAVELENGTH
    return motion


def track() -> FloatArray:
    """Return the platform without motion error, m: along y, at `HEIGHT` above the points' plane."""
    along = (np.arange(N_PULSE) - 0.5 * (N_PULSE - 1)) * VELOCITY / PRF
    return np.stack([np.zeros(N_PULSE), along, np.full(N_PULSE, HEIGHT)], axis=1)


def simulated(ground_range: float, motion: FloatArray, threads: int = 0, **options: Any) -> Echo:
    """Echo of a point at (ground_range, 0, 0) in the part of the swath about it; options as of `simulate.hrws`."""
    spacing = C / (2.0 * RANGE_SAMPLING)
    start = np.hypot(ground_range, HEIGHT) - 0.5 * spacing * N_RANGE
    given: dict[str, Any] = {"motion": motion, "doppler_bandwidth": DOPPLER_BANDWIDTH, "threads": threads} | options
    return simulate.hrws(
        track(),
        CHANNELS,
        [[ground_range, 0.0, 0.0]],
        [1.0],
        n_range=N_RANGE,
        range_start=start,
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


def image(echo: Echo, method: str, grid: ImageGrid, motion: FloatArray | None, threads: int = 0) -> npt.NDArray[np.complex64]:
    """Form the pixels by one of the methods: plain, or a reconstruction of `hrws.reconstruct` (with "-yen" for its interpolation)."""
    if method == "plain":
        return plain(echo, grid, motion, threads)
    reconstruction, _, interpolation = method.partition("-")
    return hrws.reconstruct(
        echo,
        grid,
        motion,
        reconstruction="sub_image" if reconstruction == "sub_image" else "folded",
        interpolation="yen" if interpolation == "yen" else "mmse",
        doppler_bandwidth=DOPPLER_BANDWIDTH,
        threads=threads,
    )


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


def figures(echo: Echo, method: str, ground_range: float, motion: FloatArray | None, threads: int = 0) -> dict[str, Any]:
    """Measure the point's azimuth response and its highest azimuth ambiguity."""
    about = image(echo, method, chip(ground_range, 0.0, SHAPE), motion, threads)
    slant_range = float(np.hypot(ground_range, HEIGHT))
    cells = (VELOCITY / DOPPLER_BANDWIDTH / STEP[0], C / (2.0 * BANDWIDTH) / (STEP[1] * ground_range / slant_range))
    found = quality.point_response(about, (SHAPE[0] // 2, SHAPE[1] // 2), oversampling=cells)
    offset = quality.azimuth_ambiguity_offset(prf=PRF, wavelength=WAVELENGTH, velocity=VELOCITY, slant_range=slant_range) * VELOCITY / PRF
    levels = {
        str(k): float(np.abs(image(echo, method, chip(ground_range, k * offset, AMBIGUITY_SHAPE), motion, threads)).max())
        for k in AMBIGUITIES
    }
    relative = {k: 20.0 * np.log10(level / found.amplitude) for k, level in levels.items()}
    return {
        "irw_cells": found.azimuth.irw_cells,
        "pslr_db": found.azimuth.pslr_db,
        "islr_db": found.azimuth.islr_db,
        "theory_pslr_db": found.azimuth.theory_pslr_db,
        "theory_islr_db": found.azimuth.theory_islr_db,
        "ambiguity_db": max(relative.values()),
        "ambiguities_db": relative,
    }
