"""Autofocus as the command line and the demo run it: image in, image with everything that was found out."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from . import ImageGrid, autofocus, backproject, gpga, measurement
from .grids import check_grid, resolution
from .io import Image, PhaseHistory
from .memory import require_image_memory
from .motion import along_path, synchronised
from .plain import plain

Progress = Callable[[str, int, int], None] | None


@dataclasses.dataclass
class Focused:
    """The image after autofocus and what the method returned."""

    image: Image
    result: Any


def form_image(history: PhaseHistory, grid: ImageGrid, *, threads: int = 0, progress: Progress = None) -> Image:
    """Backproject a phase history onto a grid; the grid and the memory are checked first.

    Pulses on a track are weighted by the path they stand for.
    """
    history = along_path(history)
    check_grid(history, grid)
    require_image_memory(grid.shape)
    data = backproject(
        history.data,
        history.antenna,
        grid,
        range_start=history.range_start,
        range_spacing=history.range_spacing,
        wavelength=history.wavelength,
        threads=threads,
        progress=progress,
    )
    metadata: dict[str, Any] = {"wavelength": history.wavelength, "source": history.metadata.get("source")}
    rows, columns = grid.shape
    middle = np.asarray(grid.position(0.5 * (rows - 1), 0.5 * (columns - 1)))
    return Image(data, grid=grid, metadata=metadata | {"resolution": plain(resolution(history, middle))})


def focus_image(image: Image, method: str = "auto", *, threads: int = 0, progress: Progress = None) -> Focused:
    """Run a method, or "auto" for the best of them, on an image; as a strip where the image has the geometry of one."""
    started = time.perf_counter()
    result = autofocus(image.data, image.geometry, method=method, threads=threads, progress=progress)
    return focused(image, result, str(result.diagnostics["method"]), {"autofocus": time.perf_counter() - started}, threads)


def focus_strip(image: Image, method: str = "spga_linear", *, threads: int = 0, progress: Progress = None) -> Focused:
    """Run stripmap autofocus on an image that has the geometry of its collection."""
    if image.geometry is None:
        raise ValueError(f"image: {method} needs the stripmap geometry, and this image has none; use pga")
    return focus_image(image, method, threads=threads, progress=progress)


def focus_history(
    history: PhaseHistory, grid: ImageGrid, *, time_offset: bool = True, threads: int = 0, progress: Progress = None
) -> Focused:
    """Form the image as recorded, then run autofocus by backprojection on the phase history.

    Where the positions come from a track with a clock of its own, the offset between the clocks is estimated first, unless `time_offset`
    is False: no phase per pulse can stand for it.
    """
    require_image_memory(grid.shape, copies=2)
    started = time.perf_counter()
    before = form_image(history, grid, threads=threads, progress=progress)
    seconds = {"form": time.perf_counter() - started}
    clocks: dict[str, Any] = {}
    if time_offset and history.track is not None:
        begun = time.perf_counter()
        recorded = history.track.offset
        history, found = synchronised(history, grid, threads=threads, progress=progress)
        names = ("offset", "estimate", "offset_std", "log_sharpness_before", "log_sharpness_after", "held_out_gain", "held_out_noise")
        figures = {name: plain(getattr(found, name)) for name in (*names, "status", "reason")}
        clocks = {"time_offset": {"recorded": recorded} | figures}
        seconds["time_offset"] = time.perf_counter() - begun
    history = along_path(history)
    placed = time.perf_counter()
    result = gpga(
        history.data,
        history.antenna,
        grid,
        range_start=history.range_start,
        range_spacing=history.range_spacing,
        wavelength=history.wavelength,
        threads=threads,
        progress=progress,
    )
    seconds["autofocus"] = time.perf_counter() - placed
    out = focused(before, result, "gpga", seconds, threads)
    out.image.metadata["autofocus"] |= clocks
    return out


def focused(before: Image, result: Any, method: str, seconds: dict[str, float], threads: int) -> Focused:
    """Put what autofocus returned into an image, with the image before it and the figures of both."""
    arrays = {
        "before": before.data,
        "phase_error": np.asarray(result.phase_error),
        "phase_std": np.asarray(result.phase_std),
        "points": np.asarray(result.points),
    }
    report = {
        "method": method,
        "status": plain(result.status),
        "summary": result.summary(),
        "before": measurement.whole_image(before.data, threads),
        "after": measurement.whole_image(result.image, threads),
        "seconds": seconds,
        "diagnostics": plain(result.diagnostics),
    }
    image = dataclasses.replace(before, data=result.image, metadata=before.metadata | {"autofocus": report}, arrays=before.arrays | arrays)
    return Focused(image, result)
