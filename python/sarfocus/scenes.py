"""Built-in scenes: simulated phase histories whose recorded trajectory is not the one flown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import ImageGrid, simulate
from .experiments.crlb import smooth_phase
from .grids import SPEED_OF_LIGHT, default_grid
from .io import PhaseHistory
from .io.model import FloatArray

Progress = Callable[[str, int, int], None] | None

WAVELENGTH = 0.0312  # m, X band (9.6 GHz)
BANDWIDTH = 400e6  # Hz: 0.37 m in slant range
OVERSAMPLING = 1.25  # range samples per resolution cell
GROUND_DISTANCE, HEIGHT = 4000.0, 3000.0  # m, of the track from the scene centre
TRACK_LENGTH = 220.0  # m: 0.35 m of azimuth resolution
N_PULSE = 448
SCENE_SIZE = (60.0, 60.0)  # m, azimuth and ground range
CLUTTER_PER_CELL = 1.0  # scatterers in a resolution cell: their responses overlap enough for speckle
CLUTTER_SUPPORT = 2.5  # m of slant range about a scatterer of the ground: the rest of its response, 26 dB below its peak, is left out
CLUTTER_MARGIN = 1.1  # the clutter reaches beyond the image by this factor
POINT_TO_CLUTTER_DB = 32.0  # power of a point's peak over the mean power of the clutter
POINTS = (
    (-18.0, 14.0),
    (-6.0, -12.0),
    (4.0, 6.0),
    (15.0, -17.0),
    (20.0, 19.0),
    (-22.0, -21.0),
    (1.0, -23.0),
    (11.0, 22.0),
)  # m: azimuth, range
MOTION_RMS = 0.012  # m, of the unrecorded motion along the line of sight
MOTION_CYCLES = 4  # highest harmonic of it over the aperture
SEED = 1951


@dataclass
class Scene:
    """A phase history, the grid it is meant for, and the truth."""

    history: PhaseHistory
    grid: ImageGrid
    targets: FloatArray  # [n_point, 3], m
    true_positions: FloatArray  # [n_pulse, 3], m: the path flown
    phase_error: FloatArray  # [n_pulse], rad, at the scene centre

    @property
    def item(self) -> PhaseHistory:
        """What a file of the scene holds."""
        return self.history


def spotlight(*, seed: int = SEED, motion_rms: float = MOTION_RMS, threads: int = 0, progress: Progress = None) -> Scene:
    """Simulate a spotlight collection in side view: speckle, eight points of equal strength, and a smooth motion that was not recorded.

    Parameters
    ----------
    seed : int
    motion_rms : float
        m, RMS of the motion across the track (downwards and sideways in equal parts); 0 for none.
    """
    generator = np.random.default_rng(seed)
    recorded = np.zeros((N_PULSE, 3))
    recorded[:] = (-GROUND_DISTANCE, 0.0, HEIGHT)
    recorded[:, 1] = np.linspace(-0.5, 0.5, N_PULSE) * TRACK_LENGTH
    flown = recorded + unrecorded_motion(motion_rms, generator)
    points, strength = targets(generator)
    clutter, speckle = ground(generator)
    spacing = SPEED_OF_LIGHT / (2.0 * BANDWIDTH * OVERSAMPLING)
    slant = float(np.hypot(GROUND_DISTANCE, HEIGHT))
    n_range = int(np.ceil(1.5 * SCENE_SIZE[1] / spacing))
    start = slant - 0.5 * n_range * spacing
    axis: dict[str, Any] = {"n_range": n_range, "range_start": start, "range_spacing": spacing}
    axis |= {"wavelength": WAVELENGTH, "bandwidth": BANDWIDTH, "threads": threads, "progress": progress}
    echo = simulate.points(flown, clutter, speckle, support=CLUTTER_SUPPORT, **axis)
    echo += simulate.points(flown, points, strength, **axis)
    centre = np.zeros(3)
    error = -4.0 * np.pi / WAVELENGTH * (np.linalg.norm(flown - centre, axis=1) - np.linalg.norm(recorded - centre, axis=1))
    metadata = {
        "source": f"simulated spotlight scene, seed {seed}",
        "scene_centre": centre,
        "scene_size": list(SCENE_SIZE),
        "bandwidth": BANDWIDTH,
        "motion_rms": motion_rms,
        "truth": {"phase_error": error, "targets": points},
    }
    history = PhaseHistory(echo, recorded, start, spacing, WAVELENGTH, metadata)
    return Scene(history, default_grid(history), points, flown, error)


def unrecorded_motion(rms: float, generator: np.random.Generator) -> FloatArray:
    """Return the difference between the path flown and the one recorded, m [n_pulse, 3]: smooth, across the track."""
    if rms == 0.0:
        return np.zeros((N_PULSE, 3))
    sideways, down = (smooth_phase(N_PULSE, rms, MOTION_CYCLES, generator) for _ in range(2))
    return np.stack([sideways, np.zeros(N_PULSE), down], axis=1)


def targets(generator: np.random.Generator) -> tuple[FloatArray, npt.NDArray[np.complex128]]:
    """Return positions [n, 3], m, and reflectivities of the point targets: equal strength, random phase."""
    positions = np.array([(across, along, 0.0) for along, across in POINTS])
    return positions, np.exp(2j * np.pi * generator.random(len(positions)))


def ground(generator: np.random.Generator) -> tuple[FloatArray, npt.NDArray[np.complex128]]:
    """Return positions [n, 3], m, and reflectivities of the scatterers of the ground: uniform in place, Gaussian in strength."""
    cell = WAVELENGTH * np.hypot(GROUND_DISTANCE, HEIGHT) / (2.0 * TRACK_LENGTH) * SPEED_OF_LIGHT / (2.0 * BANDWIDTH)
    count = int(CLUTTER_PER_CELL * CLUTTER_MARGIN**2 * SCENE_SIZE[0] * SCENE_SIZE[1] / cell)
    positions = np.zeros((count, 3))
    positions[:, :2] = (generator.random((count, 2)) - 0.5) * CLUTTER_MARGIN * np.array(SCENE_SIZE[::-1])
    power = 10.0 ** (-POINT_TO_CLUTTER_DB / 10.0) / CLUTTER_PER_CELL
    return positions, np.sqrt(0.5 * power) * (generator.standard_normal(count) + 1j * generator.standard_normal(count))
