"""Small phase histories, written from the definition of the data [methods.md, section 0], for the tests of the driver."""

import numpy as np

from sarfocus.io import PhaseHistory

WAVELENGTH = 0.03
SPACING = 0.5
CENTRE = (0.0, 0.0, 0.0)


def history(targets=((0.0, 0.0, 0.0),), n_pulse=96, n_range=128, seed=None, **metadata):
    """Point targets seen from a straight track 1 km away at 500 m height, flown along +y; sinc response of one sample and a quarter."""
    along = np.linspace(-20.0, 20.0, n_pulse)
    positions = np.stack([np.full(n_pulse, -1000.0), along, np.full(n_pulse, 500.0)], axis=1)
    start = np.linalg.norm(positions[n_pulse // 2]) - SPACING * (n_range // 2)
    ranges = start + SPACING * np.arange(n_range)
    data = np.zeros((n_pulse, n_range), dtype=np.complex128)
    for target in targets:
        distance = np.linalg.norm(positions - target, axis=1)[:, None]
        data += np.sinc((ranges - distance) / (1.25 * SPACING)) * np.exp(-4j * np.pi * distance / WAVELENGTH)
    if seed is not None:
        generator = np.random.default_rng(seed)
        data += 0.01 * (generator.standard_normal(data.shape) + 1j * generator.standard_normal(data.shape))
    known = {"scene_centre": list(CENTRE), "scene_size": [20.0, 20.0], "bandwidth": 299792458.0 / (2 * 1.25 * SPACING)} | metadata
    return PhaseHistory(data.astype(np.complex64), positions, start, SPACING, WAVELENGTH, known)
