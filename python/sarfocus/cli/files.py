"""``info`` and ``form``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..focusing import form_image
from ..grids import default_grid, grid_axes, resolution
from ..io import Image, PhaseHistory, read, write
from ..io.dispatch import writable
from . import forecast
from .output import Centre, Json, Output, Size, Spacing, Threads, progress_bar, show, show_rows

Inputs = Annotated[
    list[Path], typer.Argument(help="A phase history; several Gotcha .mat files are joined as one aperture.", metavar="PHASE_HISTORY...")
]


def info(
    file: Annotated[Path, typer.Argument(help="A phase history or an image.")],
    *,
    centre: Centre = None,
    size: Size = None,
    spacing: Spacing = None,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Say what a file holds, and what every method that fits it would take on this machine."""
    item = read(file)
    described = describe_history(item) if isinstance(item, PhaseHistory) else describe_image(item)
    grid = forecast.grid_of(item, centre=centre, size=size, spacing=spacing)
    onto = {} if grid is None else {"formed_on": describe_grid(grid)}
    costs = forecast.rows(item, grid, threads)
    show({"file": str(file)} | described | onto | {"costs": costs}, as_json=as_json)
    if not as_json:
        show_rows([forecast.readable(row) for row in costs], "predicted time, memory beyond input and output")


def form(
    inputs: Inputs,
    *,
    output: Output,
    centre: Centre = None,
    size: Size = None,
    spacing: Spacing = None,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Form an image by backprojection on a ground plane."""
    target = writable(output)
    started = time.perf_counter()
    history = read_history(inputs)
    grid = default_grid(history, centre=centre, size=size, spacing=spacing)
    forecast.announce(history, grid, "exact", threads)
    read_done = time.perf_counter()
    with progress_bar() as progress:
        image = form_image(history, grid, threads=threads, progress=progress)
    formed = time.perf_counter()
    write(target, image)
    seconds = {"read": read_done - started, "form": formed - read_done, "write": time.perf_counter() - formed}
    show({"output": str(target)} | describe_image(image) | {"pulses": history.data.shape[0], "seconds": seconds}, as_json=as_json)


def read_history(inputs: list[Path]) -> PhaseHistory:
    """Read a phase history that has a trajectory; anything else is refused."""
    item = read(inputs[0] if len(inputs) == 1 else inputs)
    if not isinstance(item, PhaseHistory):
        raise ValueError(f"{inputs[0]}: expected a phase history, got an image")
    if item.positions is None:
        raise ValueError(f"{inputs[0]}: has no recorded trajectory, so no image can be formed from it")
    return item


def describe_history(history: PhaseHistory) -> dict[str, Any]:
    """Return the main properties of a phase history."""
    n_pulse, n_range = history.data.shape
    start = np.atleast_1d(history.range_start)
    out: dict[str, Any] = {
        "kind": "phase_history",
        "shape": [n_pulse, n_range],
        "wavelength": history.wavelength,
        "range_start": [float(start.min()), float(start.max())],
        "range_spacing": history.range_spacing,
        "bistatic": isinstance(history.positions, tuple),
        "trajectory": history.positions is not None,
    }
    if history.positions is not None:
        track = history.phase_centres
        out["track_length"] = float(np.linalg.norm(np.diff(track, axis=0), axis=1).sum())
        out["track_ends"] = [track[0], track[-1]]
        if "scene_centre" in history.metadata:
            cell = resolution(history, np.asarray(history.metadata["scene_centre"], dtype=np.float64))
            out |= {"resolution": cell, "default_grid": describe_grid(default_grid(history))}
    if history.track is not None:
        out["track"] = {"offset": history.track.offset, "minimum_step": history.track.minimum_step, "samples": len(history.track.time)}
    return out | {"metadata": history.metadata}


def describe_image(image: Image) -> dict[str, Any]:
    """Return the main properties of an image."""
    out: dict[str, Any] = {"kind": "image", "shape": list(image.data.shape)}
    if image.grid is not None:
        out["grid"] = describe_grid(image.grid)
    if image.geometry is not None:
        out["stripmap"] = {name: getattr(image.geometry, name) for name in ("wavelength", "prf", "velocity", "doppler_bandwidth")}
    out |= {"azimuth_spacing": image.azimuth_spacing, "range_spacing": image.range_spacing}
    return out | {"arrays": {name: list(values.shape) for name, values in image.arrays.items()}, "metadata": image.metadata}


def describe_grid(grid: Any) -> dict[str, Any]:
    """Return kind, shape and steps of a grid."""
    return {"kind": grid.kind, "shape": list(grid.shape)} | grid_axes(grid)
