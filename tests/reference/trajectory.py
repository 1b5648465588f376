"""NumPy oracles of the track and of the weights by path length, and a radar carried past a scene."""

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]


def interpolate_track(time: Reals, position: Reals, at: Reals) -> Reals:
    """Every coordinate by linear interpolation."""
    return np.stack([np.interp(at, time, axis) for axis in position.T], axis=1)


def path_weights(positions: Reals, minimum_step: float) -> Reals:
    """Length of the central difference of the path, one-sided at the ends; zero at rest; mean 1 of the others."""
    step = np.linalg.norm(np.gradient(positions, axis=0), axis=1)
    step = np.where(step > minimum_step, step, 0.0)
    return step / step[step > 0].mean()


def carried(moment: Reals) -> Reals:
    """Return the path of a platform that rests for its first and its last second and speeds up and slows down between them."""
    s = np.clip(moment, 1.0, 7.0) - 4.0
    return np.stack([0.4 * s + 0.15 * np.sin(1.3 * s), 0.08 * np.cos(0.9 * s), 1.0 + 0.02 * np.sin(2.0 * s)], axis=1)
