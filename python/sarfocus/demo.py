"""The demonstration: a scene simulated on the fly, defocused by a motion that nobody recorded, brought into focus, and a page about it."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from . import scenes, strip_scene
from ._core import thread_count
from .focusing import focus_history, focus_strip, form_image
from .io import Image, write
from .report.build import build
from .report.model import Report
from .report.page import write_page

Progress = Callable[[str, int, int], None] | None
REPORT, RESULT = "report.html", "result.h5"


def run(folder: Path, *, scene: str = "strip", seed: int | None = None, threads: int = 0, progress: Progress = None) -> dict[str, Any]:
    """Simulate, focus, measure; write the report and the result into `folder` and return the main figures.

    Parameters
    ----------
    scene : {"strip", "spotlight"}
    seed : int, optional
        By default the scene's own.
    """
    if scene not in DEMOS:
        raise ValueError(f"scene: expected one of {', '.join(DEMOS)}, got {scene!r}")
    default, demonstrate = DEMOS[scene]
    seed = default if seed is None else seed
    started = time.perf_counter()
    image, page = demonstrate(seed, threads, progress)
    write(folder / RESULT, image)
    write_page(folder / REPORT, page)
    return main_figures(page, image, folder, scene, seed) | {"seconds": time.perf_counter() - started}


def run_strip(seed: int, threads: int, progress: Progress) -> tuple[Image, Report]:
    """Focus the built-in strip; return it and its page."""
    started = time.perf_counter()
    scene = strip_scene.strip(seed=seed, threads=threads, progress=progress)
    simulated = time.perf_counter()
    image = focus_strip(scene.image, threads=threads, progress=progress).image
    seconds = image.metadata["autofocus"]["seconds"]
    image.metadata["autofocus"]["seconds"] = {"simulate": simulated - started} | seconds
    page = build(
        image,
        title="sarfocus: a strip brought into focus",
        lead="A simulated X-band stripmap collection: speckle, fields, buildings and points, imaged by a processor that doesn't know "
        "how the antenna moved, and focused by autofocus that keeps the linear phase: targets come into focus and back to their places.",
        what_was_done=what_was_done_strip(scene),
        parameters=strip_parameters(scene, seed, threads),
    )
    return image, page


def what_was_done_strip(scene: strip_scene.Strip) -> list[str]:
    """Tell the story in a few sentences."""
    rows, columns = scene.image.data.shape
    motion = 1e3 * scene.image.metadata["motion_rms"]
    wavelength = 1e3 * scene.geometry.wavelength
    return [
        f"A strip of {rows} azimuth samples and {columns} range gates was simulated with an unrecorded motion of {motion:.0f} mm RMS along "
        f"the line of sight, against a wavelength of {wavelength:.1f} mm: legs of constant drift, which displace targets, and a sway.",
        "Before: azimuth compression that takes the path for straight. After: strong points were found in that image, the phase of each "
        "aperture was extracted, the apertures were stitched by the linear phases of their overlaps, the common phase was refined by "
        "maximum likelihood and taken off, all in one pass. Error-free: the same echoes without the motion, for comparison only.",
    ]


def strip_parameters(scene: strip_scene.Strip, seed: int, threads: int) -> dict[str, str]:
    """Return what was chosen, as text."""
    geometry = scene.geometry
    slant_range = np.asarray(geometry.slant_range)
    return {
        "wavelength": f"{1e3 * geometry.wavelength:.1f} mm",
        "velocity, PRF": f"{geometry.velocity:.0f} m/s, {geometry.prf:.0f} Hz",
        "Doppler bandwidth": f"{geometry.doppler_bandwidth:.0f} Hz",
        "slant range": f"{slant_range[0]:.0f} to {slant_range[-1]:.0f} m",
        "aperture": f"{geometry.aperture_samples(0):.0f} samples at the nearest gate",
        "points over clutter": f"{strip_scene.POINT_DB:.0f} dB",
        "unrecorded motion": f"{1e3 * scene.image.metadata['motion_rms']:.0f} mm RMS",
        "seed": str(seed),
        "threads": str(thread_count(threads)),
    }


def run_spotlight(seed: int, threads: int, progress: Progress) -> tuple[Image, Report]:
    """Form and focus the built-in spotlight scene; return the image and its page."""
    started = time.perf_counter()
    scene = scenes.spotlight(seed=seed, threads=threads, progress=progress)
    simulated = time.perf_counter()
    focused = focus_history(scene.history, scene.grid, threads=threads, progress=progress)
    flown = dataclasses.replace(scene.history, positions=scene.true_positions)
    ideal = form_image(flown, scene.grid, threads=threads, progress=progress)
    image = with_truth(focused.image, scene, ideal)
    seconds = image.metadata["autofocus"]["seconds"]
    image.metadata["autofocus"]["seconds"] = {"simulate": simulated - started} | seconds
    page = build(
        image,
        title="sarfocus: a spotlight scene brought into focus",
        lead="A simulated X-band spotlight collection: speckle and eight point targets, recorded with a trajectory "
        "that misses the motion of the antenna, formed by backprojection and focused by autofocus on the phase history.",
        what_was_done=what_was_done(scene),
        parameters=parameters(scene, seed, threads),
    )
    return image, page


def with_truth(image: Image, scene: scenes.Scene, ideal: Image) -> Image:
    """Add to a result what only a simulation knows: the error, the error-free image, the pixels of the targets."""
    origin, azimuth_step, range_step = np.asarray(scene.grid.vectors)
    steps = np.stack([azimuth_step, range_step], axis=1)
    pixels = np.linalg.lstsq(steps, (scene.targets - origin).T, rcond=None)[0].T
    truth = {"ideal": ideal.data, "true_phase_error": scene.phase_error, "target_pixels": pixels}
    return dataclasses.replace(image, arrays=image.arrays | truth)


def what_was_done(scene: scenes.Scene) -> list[str]:
    """Tell the story in a few sentences."""
    n_pulse, n_range = scene.history.data.shape
    rows, columns = scene.grid.shape
    motion = 1e3 * scene.history.metadata["motion_rms"]
    return [
        f"The echoes of {n_pulse} pulses ({n_range} range samples each) were simulated from the path that was flown. The recorded path, "
        f"the only one the processing knows, lacks a smooth motion of {motion:.0f} mm RMS sideways and as much up and down, against a "
        f"wavelength of {1e3 * scenes.WAVELENGTH:.1f} mm.",
        f"Before: exact backprojection with the recorded path onto a ground plane of {rows} x {columns} pixels. After: the phase error of "
        "every pulse was estimated from the strong points of that image and taken off the phase history, and the image was formed again. "
        "Error-free: backprojection with the path that was flown, for comparison only.",
    ]


def parameters(scene: scenes.Scene, seed: int, threads: int) -> dict[str, str]:
    """Return what was chosen, as text."""
    rows, columns = scene.grid.shape
    steps = np.linalg.norm(np.asarray(scene.grid.vectors)[1:], axis=1)
    return {
        "wavelength": f"{1e3 * scenes.WAVELENGTH:.1f} mm",
        "bandwidth": f"{1e-6 * scenes.BANDWIDTH:.0f} MHz",
        "slant range": f"{np.hypot(scenes.GROUND_DISTANCE, scenes.HEIGHT):.0f} m",
        "track": f"{scenes.TRACK_LENGTH:.0f} m, {scenes.N_PULSE} pulses",
        "pixels": f"{rows} x {columns} of {steps[0]:.3f} x {steps[1]:.3f} m",
        "points over clutter": f"{scenes.POINT_TO_CLUTTER_DB:.0f} dB",
        "unrecorded motion": f"{1e3 * scene.history.metadata['motion_rms']:.0f} mm RMS",
        "seed": str(seed),
        "threads": str(thread_count(threads)),
    }


def main_figures(page: Report, image: Image, folder: Path, scene: str, seed: int) -> dict[str, Any]:
    """Return what the command prints."""
    headline = {item.name: f"{item.before} → {item.after}" + (f" ({item.note})" if item.note else "") for item in page.headline}
    out: dict[str, Any] = {"scene": scene, "seed": seed, "status": image.metadata["autofocus"]["status"], "verdict": page.verdict}
    return out | headline | {"report": str(folder / REPORT), "result": str(folder / RESULT)}


DEMOS: dict[str, tuple[int, Callable[[int, int, Progress], tuple[Image, Report]]]] = {
    "strip": (strip_scene.SEED, run_strip),
    "spotlight": (scenes.SEED, run_spotlight),
}
