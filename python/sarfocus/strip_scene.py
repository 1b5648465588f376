"""The built-in strip: clutter, fields, buildings and points under a phase error that displaces what it defocuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter

from . import StripmapGeometry, azimuth_compress, azimuth_decompress, simulate
from .experiments.crlb import smooth_phase, without_line
from .experiments.strips import airborne
from .io import Image
from .io.model import ComplexArray, FloatArray

Progress = Callable[[str, int, int], None] | None

N_AZIMUTH, N_RANGE = 4096, 384
RANGE_START, RANGE_SPACING = 10000.0, 1.0  # m: apertures of 1172 samples and more
POINT_DB = 34.0  # power of a point's peak over the mean power of the clutter
N_POINT = 45
FIELDS = (
    (0.04, 0.30, 0.10, 0.42, 4.0),
    (0.36, 0.58, 0.55, 0.92, 3.0),
    (0.66, 0.94, 0.08, 0.36, 5.0),
    (0.60, 0.80, 0.52, 0.80, -8.0),
)  # shares of the axes: from, to in azimuth and range; power over the rest, dB
EDGE = (48, 12)  # pixels over which the power changes from one field to the next
BUILDINGS = ((0.16, 0.62), (0.22, 0.70), (0.44, 0.24), (0.50, 0.30), (0.84, 0.62), (0.90, 0.56))  # shares of the axes
BUILDING_SIZE, BUILDING_DB = (40, 14), 12.0  # pixels of azimuth and gates; of each of its scatterers over the clutter
DRIFTS = (0.0, 1.0, -0.6, 0.5, -1.0, 0.3)  # of the line of sight in successive legs of equal length, as shares of the largest
SWAY_SHARE, SWAY_CYCLES = 0.2, 5  # of the motion's RMS that is smooth, and its highest harmonic over the strip
MOTION_RMS = 0.03  # m along the line of sight
SEED = 2310


@dataclass
class Strip:
    """A defocused strip, with the truth among its arrays."""

    image: Image
    geometry: StripmapGeometry
    motion: FloatArray  # [n_azimuth], m, of the antenna away from the scene

    @property
    def item(self) -> Image:
        """What a file of the scene holds."""
        return self.image


def strip(*, seed: int = SEED, motion_rms: float = MOTION_RMS, threads: int = 0, progress: Progress = None) -> Strip:
    """Simulate an airborne X-band strip and the image of a processor that doesn't know the motion.

    Parameters
    ----------
    seed : int
    motion_rms : float
        m, RMS of the motion along the line of sight, its line removed; 0 for none.
    """
    generator = np.random.default_rng(seed)
    geometry = airborne(N_RANGE, RANGE_START, RANGE_SPACING)
    raw = ground(seed, threads)
    targets, strength = points(generator)
    walls, wall_strength = buildings(generator)
    scatterers, reflectivity = np.concatenate([targets, walls]), np.concatenate([strength, wall_strength])
    raw += simulate.stripmap(geometry, scatterers, reflectivity, n_azimuth=N_AZIMUTH, threads=threads)
    if progress is not None:
        progress("simulate", 1, 2)
    ideal = azimuth_compress(raw, geometry, threads=threads)
    motion = unrecorded_motion(motion_rms, generator)
    phase_error: FloatArray = -4.0 * np.pi / geometry.wavelength * motion
    raw *= np.exp(1j * phase_error)[:, None].astype(np.complex64)
    data = azimuth_compress(raw, geometry, threads=threads)
    if progress is not None:
        progress("simulate", 2, 2)
    metadata = {
        "source": f"simulated strip, seed {seed}",
        "motion_rms": motion_rms,
        "resolution": [geometry.velocity / geometry.doppler_bandwidth, RANGE_SPACING],
    }
    image = Image(data, geometry=geometry, metadata=metadata)
    image.azimuth_spacing, image.range_spacing = geometry.velocity / geometry.prf, RANGE_SPACING
    image.arrays |= {"ideal": ideal, "true_phase_error": phase_error, "target_pixels": targets}
    return Strip(image, geometry, motion)


def ground(seed: int, threads: int) -> ComplexArray:
    """Return the decompressed clutter: speckle whose power changes from field to field, band-limited again after that."""
    geometry = airborne(N_RANGE, RANGE_START, RANGE_SPACING)
    raw = simulate.stripmap(geometry, [], [], n_azimuth=N_AZIMUTH, clutter_power=1.0, seed=seed, threads=threads)
    level = np.zeros((N_AZIMUTH, N_RANGE))
    for first, last, low, high, decibel in FIELDS:
        level[round(first * N_AZIMUTH) : round(last * N_AZIMUTH), round(low * N_RANGE) : round(high * N_RANGE)] = decibel
    level = uniform_filter(level, EDGE)
    # Slow time stands for place but for half an aperture: the power is laid over the compressed speckle, in the image.
    image = azimuth_compress(raw, geometry, threads=threads)
    image *= (10.0 ** (level / 20.0)).astype(np.float32)
    spectrum = np.fft.fft(image, axis=0)
    frequency = np.fft.fftfreq(N_AZIMUTH, 1.0 / geometry.prf)
    spectrum[np.abs(frequency) > 0.5 * geometry.doppler_bandwidth] = 0.0
    return azimuth_decompress(np.fft.ifft(spectrum, axis=0).astype(np.complex64), geometry, threads=threads)


def points(generator: np.random.Generator) -> tuple[FloatArray, ComplexArray]:
    """Return pixels [n_point, 2] and reflectivities of the point targets: equal strength, random phase, one in each part of the strip."""
    azimuth = (np.arange(N_POINT) + generator.uniform(0.15, 0.85, N_POINT)) * N_AZIMUTH / N_POINT
    gates = 6 + generator.choice(N_RANGE - 12, N_POINT, replace=False)
    strength = 10.0 ** (POINT_DB / 20.0) * np.exp(2j * np.pi * generator.random(N_POINT))
    return np.stack([azimuth, gates], axis=1), strength.astype(np.complex64)


def buildings(generator: np.random.Generator) -> tuple[FloatArray, ComplexArray]:
    """Return pixels and reflectivities of the scatterers of buildings: two walls at a right angle, Gaussian in strength."""
    along, across = (np.arange(size) for size in BUILDING_SIZE)
    walls = np.concatenate([np.stack([along, 0 * along], axis=1), np.stack([0 * across, across], axis=1)])
    corners = np.array([(round(u * N_AZIMUTH), round(g * N_RANGE)) for u, g in BUILDINGS])
    pixels = (corners[:, None] + walls).reshape(-1, 2).astype(np.float64)
    power = 10.0 ** (BUILDING_DB / 10.0)
    gaussian = generator.standard_normal((2, len(pixels))) * np.sqrt(0.5 * power)
    return pixels, (gaussian[0] + 1j * gaussian[1]).astype(np.complex64)


def unrecorded_motion(rms: float, generator: np.random.Generator) -> FloatArray:
    """Return the motion along the line of sight, m [n_azimuth]: legs of constant drift, which displace targets, and a sway."""
    leg = np.minimum(np.arange(N_AZIMUTH) * len(DRIFTS) // N_AZIMUTH, len(DRIFTS) - 1)
    drift = without_line(np.cumsum(np.asarray(DRIFTS)[leg]))
    sway = smooth_phase(N_AZIMUTH, 1.0, SWAY_CYCLES, generator)
    motion = drift / np.sqrt(np.mean(drift**2)) + SWAY_SHARE * sway
    scaled: FloatArray = motion * (rms / np.sqrt(np.mean(motion**2)))
    return scaled
