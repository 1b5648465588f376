"""Time of iteration-free stripmap autofocus against one pass and six passes of the iterated one, interleaved [Xie2023, table 5].

The passes do the same on any image of a size, but for the number of points; two scenes: the seven points of table 3 and a strip of clutter
and points. One azimuth round trip, a forward and an inverse transform of the image, is the yardstick for other machines.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import StripmapGeometry, azimuth_compress, simulate, spga, spga_linear
from . import xie2023
from .model import Reproduction, Requirement, at_most
from .strips import ComplexArray, described

N = xie2023.N
ROUNDS = 5
N_POINT, PEAK_TO_CLUTTER_DB = 40, 25.0
ONE_PASS, SIX_PASSES = 1.1, 0.2  # allowed share of the time of one pass and of six
Progress = Callable[[str, int, int], None] | None
Job = Callable[[], object]


def run(*, seed: int = xie2023.SEED, n: int = N, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Time the passes on images of n x n pixels; within a round they take turns, and ratios are formed within a round."""
    generator = np.random.default_rng(seed)
    scene = xie2023.make_scene(xie2023.table_geometry(n), xie2023.SHIFTS, generator, threads=threads)
    cluttered = clutter_and_points(scene, generator, threads)
    rows: list[dict[str, Any]] = []
    required: list[Requirement] = []
    for name, image in (("seven points", scene.image), (f"clutter and {N_POINT} points", cluttered)):
        seconds = times(jobs(image, scene.geometry, threads), name, progress)
        rows += [row(method, name, seconds) for method in seconds]
        ours = np.array(seconds["spga_linear"])
        one, six = (float(np.median(ours / np.array(seconds[method]))) for method in ("spga, 1 pass", "spga, 6 passes"))
        required.append(at_most(f"{name}: spga_linear over one pass of spga", one, ONE_PASS))
        required.append(at_most(f"{name}: spga_linear over six passes of spga", six, SIX_PASSES))
    parameters = {"n": n, "rounds": ROUNDS, "seed": seed, "round_trip": "azimuth_compress: transform, phase, transform back"}
    return Reproduction(name="xie2023-time", parameters=parameters | described(scene.geometry), rows=rows, required=required)


def clutter_and_points(scene: xie2023.Scene, generator: np.random.Generator, threads: int) -> ComplexArray:
    """Return the image of clutter of unit power and strong points under the error of the scene."""
    n = len(scene.phase_error)
    points = [(float((k + generator.uniform(0.1, 0.9)) * n / N_POINT), int(generator.integers(n))) for k in range(N_POINT)]
    strength = 10.0 ** (PEAK_TO_CLUTTER_DB / 20.0) * np.exp(2j * np.pi * generator.random(N_POINT))
    effects: dict[str, Any] = {"clutter_power": 1.0, "phase_error": scene.phase_error, "seed": int(generator.integers(2**32))}
    strip = simulate.stripmap(scene.geometry, points, strength, n_azimuth=n, threads=threads, **effects)
    return azimuth_compress(strip, scene.geometry, threads=threads)


def jobs(image: ComplexArray, geometry: StripmapGeometry, threads: int) -> dict[str, Job]:
    """Return what is timed; the outputs are allocated once, and every method does all its work (none hands the input back)."""
    out = np.empty_like(image)
    common: dict[str, Any] = {"out": out, "threads": threads}
    return {
        "azimuth round trip": lambda: azimuth_compress(image, geometry, **common),
        "spga, 1 pass": lambda: spga(image, geometry, iterations=1, do_no_harm=False, **common),
        "spga_linear": lambda: spga_linear(image, geometry, do_no_harm=False, **common),
        "spga_linear, not refined": lambda: spga_linear(image, geometry, refine=False, do_no_harm=False, **common),
        "spga, 6 passes": lambda: spga(image, geometry, iterations=6, do_no_harm=False, **common),
    }


def times(work: dict[str, Job], name: str, progress: Progress) -> dict[str, list[float]]:
    """Return the seconds of every job, one for each round; a round before the first warms up."""
    seconds: dict[str, list[float]] = {method: [] for method in work}
    for turn in range(ROUNDS + 1):
        for method, job in work.items():
            started = time.perf_counter()
            job()
            if turn:
                seconds[method].append(time.perf_counter() - started)
        if progress is not None:
            progress(name, turn + 1, ROUNDS + 1)
    return seconds


def row(method: str, case: str, seconds: dict[str, list[float]]) -> dict[str, Any]:
    """Return median and spread of the seconds, and the median of the ratios within a round."""
    own = np.array(seconds[method])
    ratios = {name: float(np.median(own / np.array(seconds[other]))) for name, other in RATIOS.items()}
    return {"method": method, "case": case, "seconds": float(np.median(own)), "from": float(own.min()), "to": float(own.max())} | ratios


RATIOS = {"round_trips": "azimuth round trip", "over_one_pass": "spga, 1 pass", "over_six_passes": "spga, 6 passes"}
