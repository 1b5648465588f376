"""Conventional, two-dimensional and adaptive PGA on scenes with few, without and with many strong points [Luo2025, table 7, fig. 13].

Every method is scored in the gauge of the truth: the constant and the line that most of the difference of the phases follows, modulo whole
turns, are taken off, which moves the image as a whole. The entropy of bright points depends on where they fall between the pixels, by more
than is asked here.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import Result, adaptive_pga, conventional_pga, pga_2d, quality
from . import luo2025_scenes as scenes
from .luo2025_scenes import ComplexArray, Draw, FloatArray
from .model import Reproduction, Requirement, at_most

SHAPE = (512, 512)
SEED = 20250117
N_SEED = 5
K = 128
INPUT, UNJUDGED, CONVENTIONAL, TWO_DIMENSIONAL, ADAPTIVE = (
    "input",
    "conventional_pga, unjudged",
    "conventional_pga",
    "pga_2d",
    "adaptive_pga",
)
METHODS = (INPUT, UNJUDGED, CONVENTIONAL, TWO_DIMENSIONAL, ADAPTIVE)
WORSE = 0.001  # nat by which adaptive PGA may lose to another method
PAPER = {  # entropy (decimal logarithm), PSNR in dB of the three scenes [Luo2025, table 7]
    UNJUDGED: ((4.5903, 6.7398, 4.3726), (22.9449, 23.8824, 45.3907)),
    TWO_DIMENSIONAL: ((4.5605, 6.7035, 4.3678), (36.0162, 35.5369, 50.0451)),
    ADAPTIVE: ((4.5586, 6.7264, 4.3726), (40.1005, 32.4089, 45.3899)),
}
PADDING = 16  # of the transform whose peak is the common line
SHOWN = 256  # pixels of an image in the picture, along either axis
SHOWN_ERROR = "order 4"
Progress = Callable[[str, int, int], None] | None


@dataclass(frozen=True)
class Scored:
    """A result in the gauge of the truth."""

    image: ComplexArray
    phase: FloatArray
    row: dict[str, Any]


def run(
    *,
    data: str | os.PathLike[str] | None = None,
    seed: int = SEED,
    shape: tuple[int, int] = SHAPE,
    n_seed: int = N_SEED,
    threads: int = 0,
    progress: Progress = None,
) -> Reproduction:
    """Run all methods on every scene under every error.

    Parameters
    ----------
    data : path, optional
        Folder that holds ``sentinel1/*.tiff``; by default ``$SARFOCUS_DATA``. Without, the scenes of clutter statistics alone.
    seed : int
        The first of `n_seed` successive ones.
    """
    amplitude = scenes.excerpt(data)
    kinds = scenes.KINDS if amplitude is not None else scenes.KINDS[:1]
    seeds = [seed + k for k in range(n_seed)]
    rows: list[dict[str, Any]] = []
    pictures: dict[str, Any] = {}
    done, total = 0, len(scenes.SCENES) * len(kinds) * len(scenes.ERRORS) * n_seed
    differences: list[dict[str, Any]] = []
    for scene in scenes.SCENES:
        for kind in kinds:
            found: list[dict[str, dict[str, Any]]] = []
            for error, number, draw in draws(scene, kind, seeds, shape, amplitude):
                scored = {method: score(method, draw, threads) for method in METHODS}
                found.append({method: item.row for method, item in scored.items()})
                differences.append({"scene": scene, "kind": kind, "error": error, "seed": number} | against_others(found[-1]))
                if number == seed and error == SHOWN_ERROR:
                    pictures.setdefault(kind, {})[scene] = picture(draw, scored)
                done += 1
                if progress is not None:
                    progress("luo2025-table7", done, total)
            rows += [summed(scene, kind, method, [one[method] for one in found]) for method in METHODS]
    parameters: dict[str, Any] = {"seeds": seeds, "k": K, "paper": paper()} | scenes.described(shape, kinds)
    parameters["gauge"] = "constant and line of the truth, over the band, before anything is scored; phase RMSE modulo whole turns"
    parameters["measured"] = "sentinel1, amplitude only" if amplitude is not None else "none: --data names no folder"
    parameters["differences"] = differences
    return Reproduction(name="luo2025-table7", parameters=parameters, rows=rows, required=required(differences), pictures=pictures)


def draws(scene: str, kind: str, seeds: list[int], shape: tuple[int, int], amplitude: FloatArray | None) -> Iterator[tuple[str, int, Draw]]:
    """Yield error, seed and the draw; every one has a stream of its own."""
    place = (scenes.SCENES.index(scene), scenes.KINDS.index(kind))
    measured = amplitude if kind == scenes.MEASURED else None
    for number, error in enumerate(scenes.ERRORS):
        for seed in seeds:
            generator = np.random.default_rng([seed, *place, number])
            yield error, seed, scenes.draw(scene, error, shape, amplitude=measured, generator=generator)


def score(method: str, draw: Draw, threads: int) -> Scored:
    """Run a method and score it."""
    if method == INPUT:
        return scored(draw, draw.image, np.zeros_like(draw.phase_error), threads)
    result = estimated(method, draw.image, threads)
    out = scored(draw, result.image, np.asarray(result.phase_error), threads)
    decided = result.diagnostics.get("adaptive", {})
    gates = [part["gates"] for part in decided.get("sub_apertures", [])]
    out.row.update(status=result.status.name, gates=[min(gates), max(gates)] if gates else None)
    out.row.update(strong_points=decided.get("strong_points"), denoised=decided.get("denoised", 0) > 0)
    return out


def estimated(method: str, image: ComplexArray, threads: int) -> Result:
    """Run a method."""
    if method == TWO_DIMENSIONAL:
        return pga_2d(image, bandwidth_ratio=scenes.BANDWIDTH_RATIO, threads=threads)
    if method == ADAPTIVE:
        return adaptive_pga(image, k=K, bandwidth_ratio=scenes.BANDWIDTH_RATIO, threads=threads)
    return conventional_pga(image, k=K, do_no_harm=method == CONVENTIONAL, threads=threads)


def scored(draw: Draw, image: ComplexArray, phase: FloatArray, threads: int) -> Scored:
    """Bring image and phase to the gauge of the truth and score them."""
    line = common_line(phase - draw.phase_error)
    moved = moved_along(image, line)
    left = wrapped(phase - line - draw.phase_error)[scenes.inside(len(line), scenes.AZIMUTH_SHARE)]
    row: dict[str, Any] = {
        "entropy": quality.entropy(moved, threads=threads),
        "entropy_log10": quality.entropy_log10(moved, threads=threads),
    }
    row |= {"psnr": quality.psnr(moved, draw.truth, threads=threads), "rmse": float(np.sqrt(np.mean(left**2)))}
    row |= {"ideal": quality.entropy(draw.truth, threads=threads), "status": None, "gates": None, "strong_points": None, "denoised": False}
    return Scored(moved, phase - line, row)


def common_line(difference: FloatArray) -> FloatArray:
    """Return the constant and the line that take most of the band to zero, modulo whole turns: a slip by a turn moves no image."""
    n = len(difference)
    sample = np.arange(n, dtype=np.float64)
    band = scenes.inside(n, scenes.AZIMUTH_SHARE)
    signal = np.where(band, np.exp(1j * difference), 0.0)
    spectrum = np.fft.fft(signal, PADDING * n)
    peak = int(np.argmax(np.abs(spectrum)))
    line: FloatArray = 2.0 * np.pi * peak / (PADDING * n) * sample + float(np.angle(spectrum[peak]))
    rest = wrapped(difference - line)
    for _ in range(2):  # what the raster of the peak leaves is far below a turn
        line = line + np.polynomial.Polynomial.fit(sample[band], rest[band], 1)(sample)
        rest = wrapped(difference - line)
    return line


def wrapped(phase: FloatArray) -> FloatArray:
    """Return the phase modulo whole turns, between -pi and pi."""
    out: FloatArray = np.angle(np.exp(1j * phase))
    return out


def moved_along(image: ComplexArray, line: FloatArray) -> ComplexArray:
    """Return the image with exp(j line) on its azimuth spectrum: moved as a whole."""
    spectrum = np.fft.fft(image, axis=0) * np.exp(1j * np.fft.ifftshift(line))[:, None]
    return np.fft.ifft(spectrum, axis=0).astype(np.complex64)


def against_others(found: dict[str, dict[str, Any]]) -> dict[str, float]:
    """Return by how much the entropy of adaptive PGA exceeds that of every other, nat."""
    return {method: found[ADAPTIVE]["entropy"] - found[method]["entropy"] for method in METHODS[:-1]}


def summed(scene: str, kind: str, method: str, found: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the row of a method: means, and the worst of all draws."""

    def of(name: str) -> FloatArray:
        return np.array([one[name] for one in found])

    gates = [value for one in found if one["gates"] for value in one["gates"]]
    row: dict[str, Any] = {"method": method, "case": f"{scene}, {kind}", "scene": scene, "kind": kind, "draws": len(found)}
    row |= {name: float(of(name).mean()) for name in ("entropy", "entropy_log10", "psnr", "rmse")}
    row |= {
        "entropy_over_ideal": float((of("entropy") - of("ideal")).mean()),
        "worst_over_ideal": float((of("entropy") - of("ideal")).max()),
    }
    row |= {"worst_psnr": float(of("psnr").min()), "worst_rmse": float(of("rmse").max())}
    passed = [one["strong_points"] for one in found if one["strong_points"] is not None]
    row |= {"strong_points": sum(passed) if passed else None, "denoised": sum(one["denoised"] for one in found)}
    row |= {"status": dict(Counter(one["status"] for one in found if one["status"])), "gates": [min(gates), max(gates)] if gates else None}
    return row


def required(differences: list[dict[str, Any]]) -> list[Requirement]:
    """Return the bounds: adaptive PGA against the other methods, the worst draw of every scene, and against the input."""
    out = []
    for scene in scenes.SCENES:
        own = [item for item in differences if item["scene"] == scene]
        for method in METHODS[1:-1]:
            worst = max(own, key=lambda item: float(item[method]))
            where = f"{worst['kind']}, {worst['error']}, seed {worst['seed']}"
            out.append(at_most(f"scene {scene}: entropy of adaptive PGA less that of {method}, nat, worst: {where}", worst[method], WORSE))
        out.append(at_most(f"scene {scene}: entropy of adaptive PGA less that of the input, nat", max(item[INPUT] for item in own), 0.0))
    return out


def paper() -> dict[str, Any]:
    """Return the paper's figures by method, in the order of the scenes."""
    return {method: {"entropy_log10": list(entropy), "psnr": list(psnr)} for method, (entropy, psnr) in PAPER.items()}


def picture(draw: Draw, found: dict[str, Scored]) -> dict[str, Any]:
    """Return what the picture of a scene shows: phases over the band and the surroundings of the brightest pixel."""
    n_azimuth, n_range = draw.truth.shape
    brightest = np.unravel_index(int(np.argmax(np.abs(draw.truth))), draw.truth.shape)
    first = [int(np.clip(at - SHOWN // 2, 0, max(0, size - SHOWN))) for at, size in zip(brightest, (n_azimuth, n_range), strict=True)]
    cut = (slice(first[0], first[0] + SHOWN), slice(first[1], first[1] + SHOWN))
    shown = (INPUT, UNJUDGED, TWO_DIMENSIONAL, ADAPTIVE)
    band = scenes.inside(n_azimuth, scenes.AZIMUTH_SHARE)
    level = float(np.sqrt(np.mean(np.abs(draw.truth) ** 2)))
    return {
        "sample": np.flatnonzero(band),
        "truth": draw.phase_error[band],
        "phases": {method: nearest(found[method].phase, draw.phase_error)[band] for method in shown[1:]},
        "images": {method: found[method].image[cut] / level for method in shown} | {"error-free": draw.truth[cut] / level},
    }


def nearest(phase: FloatArray, truth: FloatArray) -> FloatArray:
    """Return the phase moved by as many whole turns as bring its median nearest to the truth."""
    turns: FloatArray = phase - 2.0 * np.pi * np.round(np.median(phase - truth) / (2.0 * np.pi))
    return turns


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw phases and images of the three scenes, a file for each kind; return the files written."""
    from ..report.figures import save  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.scene_figures import scenes_figure  # noqa: PLC0415

    paths = []
    for kind, held in result.pictures.items():
        paths.append(folder / f"luo2025_table7_{kind.partition(' ')[0]}.png")
        save(scenes_figure(held), paths[-1])
    return paths
