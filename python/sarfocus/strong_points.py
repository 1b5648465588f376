"""Small regions round the strong points of an image, for `hrws.si_mec`."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from . import detect
from ._core.geometry import ImageGrid


def strong_regions(
    image: npt.NDArray[np.complex64],
    grid: ImageGrid,
    count: int,
    *,
    sections: int = 16,
    apart: tuple[int, int] = (4, 4),
    reach: tuple[int, int] = (1, 1),
    fine: tuple[int, int] = (2, 2),
    threads: int = 0,
) -> list[ImageGrid]:
    """Chips round the points of an image that stand out most of the clutter of their range gate, as many in every section of the track.

    In a pulse a point competes with all that the beam lights at its range: pixels are compared after division by the mean power of their
    range gate. The image need not be in focus, as long as the points are to be seen in it.

    Parameters
    ----------
    image : complex64 [n_azimuth, n_range]
    grid : ImageGrid
        Of the image, plane.
    count : int
        So many regions, fewer where the image has no more maxima.
    sections : int
        Of the azimuth, each of which gives its share: every pulse needs points that it sees.
    apart : (int, int)
        Pixels either way within which a point is the brightest.
    reach : (int, int)
        Pixels of the image either way that a region covers.
    fine : (int, int)
        Pixels of a region to one of the image: half a resolution cell or less.
    threads : int
        0: all.

    Returns
    -------
    list of ImageGrid

    Raises
    ------
    ValueError
        Another kind of grid, an image of another shape, sections that don't fit.
    """
    if grid.kind != "plane":
        raise ValueError(f"grid: expected a plane one, got {grid.kind}")
    if image.shape != tuple(grid.shape):
        raise ValueError(f"image: expected the shape of the grid {tuple(grid.shape)}, got {image.shape}")
    if not 1 <= sections <= image.shape[0]:
        raise ValueError(f"sections: expected 1 to {image.shape[0]}, got {sections}")
    power = np.square(np.abs(image))
    gate = power.mean(axis=0)
    power /= np.where(gate > 0.0, gate, 1.0)
    share = -(-count // sections)
    edges = np.linspace(0, len(power), sections + 1).astype(int)
    regions = []
    for begin, end in pairwise(edges):
        found = detect.local_maxima(power[begin:end], half_width=apart, count=share, threads=threads)
        regions += [_chip(grid, (int(p["azimuth"]) + int(begin), int(p["range"])), reach, fine) for p in found]
    return regions


def _chip(grid: ImageGrid, at: tuple[int, int], reach: tuple[int, int], fine: tuple[int, int]) -> ImageGrid:
    corner = grid.position(at[0] - reach[0], at[1] - reach[1])
    _, azimuth_step, range_step = grid.vectors
    shape = (2 * reach[0] * fine[0] + 1, 2 * reach[1] * fine[1] + 1)
    return ImageGrid.plane(corner, azimuth_step / fine[0], range_step / fine[1], shape)
