"""Motion compensation by sub-images against PGA and BP-FMSA on a scene of 20 km x 2 km [Zhou2022, table 3, fig. 7-8].

The radar and its white height error are those of table 2. The amplitude of a measured SAR image, mirrored until it fills the scene, one of
its pixels to one scatterer, counts as scattering coefficients, with random phases; no point is added. Without measured data it is that of
simulated clutter with points. The beam has a fixed width, so that no pulse sees all of the scene: the motion is estimated from strong
points all over it, which stand out of the image without compensation, and once more from those that stand out of the image it gives; of the
two images that of less entropy counts. PGA gets a chip about the strongest point, BP-FMSA a strip of the whole length.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import ImageGrid, MemoryEstimateError, hrws, quality, simulate
from .._core import available_memory
from ..memory import GIB, SAMPLE_BYTES
from . import luo2025_scenes as amplitudes
from . import zhou2022 as radar
from .model import Reproduction, Requirement, at_most
from .zhou2022 import ComplexArray, FloatArray

NAME = "zhou2022-table3"
SEED = 20220221
LOSS = 0.002  # of the entropy that the error cost
NONE, PGA, BP_FMSA, FIRST, SI_MEC, TRUE = "none", "PGA", "BP-FMSA", "SI-MEC, first pass", "SI-MEC", "true motion"
METHODS = (NONE, PGA, BP_FMSA, FIRST, SI_MEC, TRUE)
PAPER = {NONE: 16.4974, PGA: 16.4958, BP_FMSA: 15.8944, SI_MEC: 15.8259}
BAND: dict[str, Any] = {"doppler_bandwidth": radar.DOPPLER_BANDWIDTH}
SIMULATED_SHAPE = (601, 1401)  # of the amplitude that stands in for the measured one: as large
BASE_BYTES = GIB // 4  # of the program and its libraries
# Scatterers for every pixel along either axis: they lie anywhere between pixels. In the middle of each the image would be free of
# speckle, and its entropy would fall with any shift.
DENSITY = 1.01
MARGIN = 300.0  # m of range recorded before and behind the scene
Progress = Callable[[str, int, int], bool | None] | None


@dataclass(frozen=True)
class Setup:
    """How much of the scene, and how finely."""

    ground: tuple[float, float] = (50e3, 70e3)  # m
    along: float = 2000.0  # m
    pixel: tuple[float, float] = (1.0, 2.0)  # m, azimuth and ground range; the cell is 1.0 m x 1.03 to 1.08 m
    points: int = 8192
    points_again: int = 16384  # of the second pass, closer together
    pga_chip: tuple[int, int] = (128, 32)  # pixels
    strip: int = 8  # pixels of range that BP-FMSA judges by
    bp_fmsa_iterations: int = 60

    @property
    def shape(self) -> tuple[int, int]:
        """Pixels of the image, azimuth and range."""
        return round(self.along / self.pixel[0]), round((self.ground[1] - self.ground[0]) / self.pixel[1])

    @property
    def n_pulse(self) -> int:
        """Pulses that see the ends of the nearest range in full."""
        aperture = self.slant[0] * radar.WAVELENGTH * radar.DOPPLER_BANDWIDTH / (2.0 * radar.VELOCITY)
        return int((self.along + aperture) * radar.PRF / radar.VELOCITY)

    @property
    def slant(self) -> tuple[float, float]:
        """Nearest and farthest slant range at broadside, m."""
        return float(np.hypot(self.ground[0], radar.HEIGHT)), float(np.hypot(self.ground[1], radar.HEIGHT))

    @property
    def n_range(self) -> int:
        """Range samples of a pulse."""
        return int((self.slant[1] - self.slant[0] + 2.0 * MARGIN) * 2.0 * radar.RANGE_SAMPLING / radar.C)

    @property
    def scatterers(self) -> tuple[int, int]:
        """Scatterers of the scene, azimuth and range."""
        return round(DENSITY * self.shape[0]), round(DENSITY * self.shape[1])

    def grid(self) -> ImageGrid:
        """Pixels of the images."""
        return self._grid(self.shape)

    def scene(self) -> ImageGrid:
        """Scatterers of the scene."""
        return self._grid(self.scatterers)

    def _grid(self, shape: tuple[int, int]) -> ImageGrid:
        step = (self.along / shape[0], (self.ground[1] - self.ground[0]) / shape[1])
        origin = (self.ground[0] + 0.5 * step[1], -0.5 * self.along + 0.5 * step[0], 0.0)
        return ImageGrid.plane(origin, (0.0, step[0], 0.0), (step[1], 0.0, 0.0), shape)

    def bytes(self) -> int:
        """Memory needed at the same time: the echo, the evenly spaced one, an image and what BP-FMSA adds up in its strip."""
        samples = len(radar.CHANNELS) * self.n_pulse
        return (
            2 * samples * self.n_range + self.shape[0] * self.shape[1] + self.shape[0] * self.strip * samples
        ) * SAMPLE_BYTES + BASE_BYTES


def run(
    *,
    data: str | os.PathLike[str] | None = None,
    seed: int = SEED,
    threads: int = 0,
    progress: Progress = None,
    setup: Setup | None = None,
) -> Reproduction:
    """Run the table; the seed draws the motion error and the phases of the scene.

    Raises
    ------
    ValueError
        No measured amplitude below `data`.
    MemoryEstimateError
        There is too little memory.
    """
    setup = setup or Setup()
    measured = amplitudes.excerpt(data)
    steps = _Steps(threads, progress, setup)
    truth = radar.height_error(seed, setup.n_pulse)
    view, echo = simulated(setup, measured, seed, truth, steps)
    rows: list[dict[str, Any]] = []
    pictures: dict[str, Any] = {"setup": setup, "truth": truth}

    def finish(method: str, image: ComplexArray, **more: Any) -> None:
        row = {"method": method, "entropy": quality.entropy(image, threads=threads), "paper": PAPER.get(method)}
        rows.append(row | steps.last() | more)
        pictures[method] = view.of(image)

    grid = setup.grid()
    image = steps.run(NONE, lambda **how: hrws.reconstruct(echo, grid, **BAND, **how))
    finish(NONE, image)
    sections = max(2, round(setup.along / 60.0))
    regions = hrws.strong_regions(image, grid, setup.points, sections=sections, threads=threads)
    chip, strip = phase_regions(setup, image)
    del image
    made = steps.run(PGA, lambda **how: hrws.pga(echo, grid, chip, do_no_harm=False, **BAND, **how))
    finish(PGA, made.image, estimate_seconds=made.timings["estimate"])
    del made
    made = steps.run(BP_FMSA, lambda **how: hrws.bp_fmsa(echo, grid, strip, iterations=setup.bp_fmsa_iterations, **BAND, **how))
    finish(BP_FMSA, made.image, estimate_seconds=made.timings["estimate"])
    del made
    first = steps.run(FIRST, lambda **how: hrws.si_mec(echo, grid, regions, pixels="brightest", **BAND, **how))
    finish(FIRST, first.image, estimate_seconds=seconds_of_estimate(first))
    regions_again = hrws.strong_regions(first.image, grid, setup.points_again, sections=sections, apart=(2, 2), threads=threads)
    follow = hrws.moved(echo, first.motion)
    # What its points say of the first pass is that no more is to be had than chance: the entropy of the whole image is the judge.
    unjudged: dict[str, Any] = {"pixels": "brightest", "do_no_harm": False}
    second = steps.run(SI_MEC, lambda **how: hrws.si_mec(follow, grid, regions_again, **unjudged, **BAND, **how))
    motion, image = first.motion + second.motion, second.image
    if quality.entropy(image, threads=threads) > rows[-1]["entropy"]:
        motion, image = first.motion, first.image
    finish(SI_MEC, image, estimate_seconds=seconds_of_estimate(second))
    image = steps.run(TRUE, lambda **how: hrws.reconstruct(echo, grid, truth, **BAND, **how))
    finish(TRUE, image)
    pictures |= {"motion": motion, "motion_std": second.motion_std}
    parameters = described(setup, seed, measured is not None) | {
        "motion": told(second, motion, truth),
        "motion_first_pass": told(first, first.motion, truth),
        "n_region": [len(regions), len(regions_again)],
        "memory_stated_gib": setup.bytes() / GIB,
        "echo_seconds": steps.seconds["echo"],
        "seconds": sum(steps.seconds.values()),
        "cpu_seconds": time.process_time() - steps.cpu,
        "peak_memory_gib": peak_gib(),
    }
    return Reproduction(name=NAME, parameters=parameters, rows=rows, required=bounds(rows), pictures=pictures)


class _Steps:
    """Runs the steps one by one; says how much memory they need before the first, and how long each took."""

    def __init__(self, threads: int, progress: Progress, setup: Setup) -> None:
        needed, free = setup.bytes(), available_memory()
        if free and needed > free:
            raise MemoryEstimateError(f"{NAME} needs {needed / GIB:.1f} GiB, {free / GIB:.1f} GiB are free")
        self.threads, self.progress = threads, progress
        self.cpu = time.process_time()
        self.seconds: dict[str, float] = {}
        if progress is not None:
            progress(f"{NAME}: needs {needed / GIB:.1f} GiB, {setup.shape[0]} x {setup.shape[1]} pixels", 1, 1)

    def run(self, name: str, job: Callable[..., Any]) -> Any:
        """Run a step that takes `threads` and `progress`."""
        inner = None
        if self.progress is not None:
            outer = self.progress
            inner = lambda phase, done, total: outer(f"{name}: {phase}", done, total)  # noqa: E731
        started = time.perf_counter()
        made = job(threads=self.threads, progress=inner)
        self.seconds[name] = time.perf_counter() - started
        return made

    def last(self) -> dict[str, float]:
        """Return time and memory of the last step: the most that the process has held up to its end."""
        return {"seconds": list(self.seconds.values())[-1], "peak_gib": peak_gib()}


def peak_gib() -> float:
    """Return the most memory that this process has held so far."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / GIB


def coefficients(setup: Setup, measured: FloatArray | None, seed: int) -> ComplexArray:
    """Return the scattering coefficients [azimuth, range]: the amplitude mirrored until it fills the scene, with random phases."""
    generator = np.random.default_rng([seed, 1])
    amplitude = measured
    if amplitude is None:
        amplitude = np.abs(amplitudes.coefficients(amplitudes.MANY, SIMULATED_SHAPE, None, generator))
    rows, columns = (mirrored(n, size) for n, size in zip(setup.scatterers, amplitude.shape, strict=True))
    out = np.empty(setup.scatterers, np.complex64)
    for i, row in enumerate(rows):
        out[i] = amplitude[row, columns] * np.exp(2j * np.pi * generator.random(setup.scatterers[1], dtype=np.float32))
    return out


def mirrored(n: int, size: int) -> npt.NDArray[np.intp]:
    """Return the indices of n pixels of something that has `size` and mirrored copies of itself behind it."""
    place = np.arange(n) % (2 * size)
    return np.where(place < size, place, 2 * size - 1 - place)


def simulated(setup: Setup, measured: FloatArray | None, seed: int, truth: FloatArray, steps: _Steps) -> tuple[Views, hrws.Echo]:
    """Return the echo of the scene, which is then forgotten, and what the pictures show of it."""
    scene = coefficients(setup, measured, seed)
    return Views(setup, scene), steps.run("echo", lambda **how: echo_of(setup, scene, truth, **how))


def echo_of(setup: Setup, scene: ComplexArray, truth: FloatArray, **how: Any) -> hrws.Echo:
    """Return the echo of the scene, every pulse off its height by the motion error."""
    return simulate.hrws_scene(
        radar.track(setup.n_pulse),
        radar.CHANNELS,
        scene,
        setup.scene(),
        n_range=setup.n_range,
        range_start=setup.slant[0] - MARGIN,
        range_spacing=radar.C / (2.0 * radar.RANGE_SAMPLING),
        wavelength=radar.WAVELENGTH,
        bandwidth=radar.BANDWIDTH,
        prf=radar.PRF,
        motion=truth,
        doppler_bandwidth=radar.DOPPLER_BANDWIDTH,
        **how,
    )


def phase_regions(setup: Setup, image: ComplexArray) -> tuple[ImageGrid, ImageGrid]:
    """Return what PGA and BP-FMSA estimate from: a chip about the brightest pixel, and a strip of the whole length with the most energy."""
    grid = setup.grid()
    at = np.unravel_index(int(np.argmax(np.abs(image))), image.shape)
    size = (min(setup.pga_chip[0], image.shape[0]), min(setup.pga_chip[1], image.shape[1]))
    begin = [min(max(int(i) - n // 2, 0), whole - n) for i, n, whole in zip(at, size, image.shape, strict=True)]
    gates = np.sum(np.square(np.abs(image)) ** 2, axis=0, dtype=np.float64)
    first = int(np.argmax(np.convolve(gates, np.ones(setup.strip), mode="valid")))
    return grid.subgrid(begin, size), grid.subgrid((0, first), (image.shape[0], setup.strip))


class Views:
    """What the pictures show of an image: all of it by mean powers of blocks, and the part about the brightest block of the scene."""

    DETAIL = (160.0, 400.0)  # m, azimuth and ground range
    BLOCKS = (200, 1000)  # at most

    def __init__(self, setup: Setup, scene: ComplexArray) -> None:
        self.block = tuple(max(1, -(-n // most)) for n, most in zip(setup.shape, self.BLOCKS, strict=True))
        size = [min(n, round(metres / step)) for n, metres, step in zip(setup.shape, self.DETAIL, setup.pixel, strict=True)]
        power = self.reduced(scene)
        at = np.unravel_index(int(np.argmax(power)), power.shape)
        centre = [int(i) * b for i, b in zip(at, self.block, strict=True)]
        self.begin = [min(max(c - n // 2, 0), whole - n) for c, n, whole in zip(centre, size, setup.shape, strict=True)]
        self.size = size

    def reduced(self, image: ComplexArray) -> npt.NDArray[np.float32]:
        """Return the mean power of blocks; what doesn't fill one at the end is left out."""
        rows, columns = (n // b for n, b in zip(image.shape, self.block, strict=True))
        out = np.empty((rows, columns), np.float32)
        for i in range(rows):
            part = image[i * self.block[0] : (i + 1) * self.block[0], : columns * self.block[1]]
            out[i] = np.square(np.abs(part)).reshape(self.block[0], columns, self.block[1]).mean(axis=(0, 2))
        return out

    def of(self, image: ComplexArray) -> dict[str, Any]:
        """Return what the pictures show of an image."""
        (i, j), (rows, columns) = self.begin, self.size
        return {"whole": self.reduced(image), "detail": image[i : i + rows, j : j + columns].copy(), "begin": (i, j)}


def residual(motion: FloatArray, truth: FloatArray) -> FloatArray:
    """Return the error of the height, m, without a constant and a line: the gauge."""
    pulse = np.arange(len(truth))
    left = (motion - truth)[:, 2]
    return np.asarray(left - np.polynomial.Polynomial.fit(pulse, left, 1)(pulse))


def seconds_of_estimate(found: hrws.SiMecResult) -> float:
    """Return the time of everything but the reconstruction."""
    return sum(found.timings.values()) - found.timings["reconstruction"]


def told(found: hrws.SiMecResult, motion: FloatArray, truth: FloatArray) -> dict[str, Any]:
    """Return what a pass says of itself, and how far the motion is from the truth."""
    left = residual(motion, truth)
    return {
        "status": found.status.name,
        "reason": found.reason,
        "coherence_before": found.coherence_before,
        "coherence": found.coherence,
        "coherence_by_chance": found.coherence_by_chance,
        "held_out": float(np.mean(found.regions["held_out"])),
        "rms_wavelengths": float(np.sqrt(np.mean(left**2)) / radar.WAVELENGTH),
        "rms_between_pulses_wavelengths": float(np.std(np.diff(left)) / np.sqrt(2.0) / radar.WAVELENGTH),
        "stated_rms_wavelengths": float(np.sqrt(np.nanmean(found.motion_std[:, 2] ** 2)) / radar.WAVELENGTH),
        "error_rms_wavelengths": float(np.sqrt(np.mean(truth[:, 2] ** 2)) / radar.WAVELENGTH),
        "seconds": dict(found.timings),
    }


def described(setup: Setup, seed: int, measured: bool) -> dict[str, Any]:
    """Return the parameters of the experiment."""
    return {
        "amplitude": "Sentinel-1 excerpt, mirrored" if measured else "simulated clutter with points, mirrored",
        "ground_range": list(setup.ground),
        "along_track": setup.along,
        "pixel": list(setup.pixel),
        "shape": list(setup.shape),
        "wavelength": radar.WAVELENGTH,
        "bandwidth": radar.BANDWIDTH,
        "range_sampling": radar.RANGE_SAMPLING,
        "prf": radar.PRF,
        "doppler_bandwidth": radar.DOPPLER_BANDWIDTH,
        "height": radar.HEIGHT,
        "velocity": radar.VELOCITY,
        "channels": radar.CHANNELS.tolist(),
        "n_pulse": setup.n_pulse,
        "n_range": setup.n_range,
        "seed": seed,
    }


def bounds(rows: list[dict[str, Any]]) -> list[Requirement]:
    """Return the bound on what SI-MEC leaves of the entropy that the error cost."""
    entropy = {row["method"]: row["entropy"] for row in rows}
    lost = (entropy[SI_MEC] - entropy[TRUE]) / (entropy[NONE] - entropy[TRUE])
    return [at_most(f"{SI_MEC}: entropy over that with the true motion, share of what the error cost", lost, LOSS)]


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw the images, whole and in part, and what is left of the motion error; return the files written."""
    from ..report.figures import save  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.hrws_figures import residual_figure, scene_figure  # noqa: PLC0415

    held = result.pictures
    setup: Setup = held["setup"]
    shown = {method: held[method] for method in METHODS if method in held}
    entropy = {row["method"]: row["entropy"] for row in result.rows}
    titles = {method: f"{method}: entropy {entropy[method]:.4f}" for method in shown}
    (i, j), detail = held[TRUE]["begin"], held[TRUE]["detail"].shape
    along, ground = -0.5 * setup.along, setup.ground[0]
    whole = (ground, setup.ground[1], along, -along)
    part = (
        ground + j * setup.pixel[1],
        ground + (j + detail[1]) * setup.pixel[1],
        along + i * setup.pixel[0],
        along + (i + detail[0]) * setup.pixel[0],
    )
    pictures = {
        "zhou2022_table3.png": scene_figure(
            {titles[m]: np.sqrt(v["whole"]) for m, v in shown.items()}, titles[TRUE], whole, columns=1, floor_db=-25.0, box=part
        ),
        "zhou2022_table3_detail.png": scene_figure({m: v["detail"] for m, v in shown.items()}, TRUE, part, columns=3, floor_db=-40.0),
        "zhou2022_table3_motion.png": residual_figure(
            held["truth"][:, 2], residual(held["motion"], held["truth"]), held["motion_std"][:, 2], radar.WAVELENGTH
        ),
    }
    for name, made in pictures.items():
        save(made, folder / name)
    return [folder / name for name in pictures]
