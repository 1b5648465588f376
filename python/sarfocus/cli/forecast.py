"""What runs will take, told before they start."""

from __future__ import annotations

import sys
from typing import Any

from .. import ImageGrid, cost
from .._core import available_memory
from ..grids import default_grid
from ..io import Image, PhaseHistory
from ..memory import GIB, SAMPLE_BYTES, require_image_memory

LONG = 10.0  # s, of runs that are announced
LEAST_SAMPLES, LEAST_PIXEL_PULSES = 1 << 22, 5e9  # less is never long: the machine needn't be measured


def grid_of(item: PhaseHistory | Image, **options: Any) -> ImageGrid | None:
    """Return the pixels that would be formed; none for an image, and for a phase history without trajectory or scene centre."""
    if not isinstance(item, PhaseHistory) or item.positions is None:
        return None
    if options["centre"] is None and "scene_centre" not in item.metadata:
        return None
    return default_grid(item, **options)


def rows(item: PhaseHistory | Image, grid: ImageGrid | None, threads: int) -> list[dict[str, Any]]:
    """Return time, s, memory beyond input and output, bytes, and whether that is free now, for every method that fits."""
    if isinstance(item, PhaseHistory) and grid is None:
        return []
    shape = item.data.shape if grid is None else grid.shape
    output = shape[0] * shape[1] * SAMPLE_BYTES
    found = cost.costs(item, grid, threads=threads)
    return [{"method": name, "seconds": one.seconds, "memory": one.memory, "fits": cost.fits(one, output)} for name, one in found.items()]


def readable(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row for a reader: warned where the memory is more than what is free."""
    warning = "" if row["fits"] else f"more than the {available_memory() / GIB:.1f} GiB that are free"
    return {"method": row["method"], "seconds": row["seconds"], "GiB": row["memory"] / GIB, "": warning}


def announce(item: PhaseHistory | Image, grid: ImageGrid | None, method: str, threads: int) -> None:
    """Say on stderr, in one line, what a run will take, where that is long."""
    if isinstance(item, Image):
        n_azimuth, n_range = item.data.shape
        if item.data.size < LEAST_SAMPLES:
            return
        found = cost.autofocus_cost(method, (n_azimuth, n_range), strip=item.geometry is not None, threads=threads)
    else:
        assert grid is not None
        if float(grid.shape[0]) * grid.shape[1] * item.data.shape[0] < LEAST_PIXEL_PULSES:
            return
        require_image_memory(grid.shape)  # no forecast of what will be refused
        found = cost.backproject_cost(item, grid, method, threads=threads)
    if found.seconds > LONG:
        sys.stderr.write(f"{method}: about {found.seconds:.0f} s and {found.memory / GIB:.1f} GiB beyond input and output\n")
        sys.stderr.flush()
