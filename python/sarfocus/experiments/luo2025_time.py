"""Time and memory of conventional, adaptive and two-dimensional PGA over the size of the image, interleaved [Luo2025, table 8, fig. 14].

The methods of the paper correct and do not ask whether that did any good; so they are timed here. Beside them, for fewer rounds: both with
the judgement that is the default, which stops early where it refuses the phase.

The yardstick for other machines is one round trip: transforms of all range gates along azimuth and back, with a phase between them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.fft

from .. import StripmapGeometry, adaptive_pga, azimuth_compress, conventional_pga, pga_2d
from . import luo2025_scenes as scenes
from .luo2025_scenes import ComplexArray
from .model import Reproduction, Requirement, at_most
from .strips import airborne

SIZES = ((2048, 2048), (2048, 4096), (4096, 4096), (4096, 8192), (8192, 8192), (8192, 16384))  # the paper's, range x azimuth
ROUNDS = (7, 7, 5, 5, 3, 3)
ROUNDS_BESIDE = 1  # of what is only printed beside: two-dimensional PGA and the judged methods
SECONDS = (15.0, 15.0, 20.0, 30.0, 60.0, 150.0)  # for the rounds of a scene: none begins after that, the first excepted; 18 min in all
TILE = 2048  # pixels of the texture, which is repeated
SEED = 20250118
ALLOWED = 1.02
TRIP, CONVENTIONAL, ADAPTIVE, TWO_DIMENSIONAL = "azimuth round trip", "conventional_pga", "adaptive_pga", "pga_2d"
JUDGED_CONVENTIONAL, JUDGED_ADAPTIVE = "conventional_pga, judged", "adaptive_pga, judged"
BESIDE = (TWO_DIMENSIONAL, JUDGED_CONVENTIONAL, JUDGED_ADAPTIVE)
ERROR = "order 4"
PAPER = {  # s: conventional, improved, two-dimensional PGA over SIZES [Luo2025, table 8]
    scenes.FEW: (
        (0.1548, 0.2149, 0.3172, 0.5835, 1.1586, 2.2858), (0.1568, 0.2177, 0.3213, 0.5910, 1.1726, 2.3112),
        (0.1963, 0.3056, 0.5391, 1.0526, 2.0539, 3.8471),
    ),
    scenes.NONE: (
        (0.1406, 0.1945, 0.2836, 0.5418, 1.0942, 2.0744), (0.1435, 0.1985, 0.2894, 0.5528, 1.1158, 2.1138),
        (0.1792, 0.2701, 0.5143, 0.8865, 1.8295, 3.5928),
    ),
    scenes.MANY: (
        (0.1701, 0.2374, 0.3774, 0.6197, 1.2433, 2.4371), (0.1736, 0.2422, 0.3849, 0.6318, 1.2668, 2.4805),
        (0.2048, 0.3270, 0.5992, 1.1445, 2.2587, 4.1944),
    ),
}  # fmt: skip
Progress = Callable[[str, int, int], None] | None
Job = Callable[[], object]


def run(
    *,
    seed: int = SEED,
    sizes: tuple[tuple[int, int], ...] = SIZES,
    rounds: tuple[int, ...] = ROUNDS,
    rounds_beside: int = ROUNDS_BESIDE,
    budget: tuple[float, ...] = SECONDS,
    threads: int = 0,
    progress: Progress = None,
) -> Reproduction:
    """Time every method on the three scenes of clutter statistics, in random order within a round; ratios are formed within a round.

    Parameters
    ----------
    sizes : tuple of (range, azimuth)
    rounds : tuple of int
        For every size, at most. A round before the first warms up, without what is printed beside.
    rounds_beside : int
        In which two-dimensional PGA and the judged methods take part.
    budget : tuple of float
        s, for every size: no round but the first begins later.
    """
    rows: list[dict[str, Any]] = []
    required: list[Requirement] = []
    for number, (n_range, n_azimuth) in enumerate(sizes):
        for place, scene in enumerate(scenes.SCENES):
            generator = np.random.default_rng([seed, number, place])
            image = large(scene, (n_azimuth, n_range), generator)
            measured = Clock(jobs(image, threads), generator, image.nbytes)
            measured.run(rounds[number], rounds_beside, budget[number])
            case = f"{scene}, {n_range} x {n_azimuth}"
            quoted = published(scene, (n_range, n_azimuth))
            timed = [method for method, own in measured.seconds.items() if own]
            rows += [row(measured, method, case, quoted) | {"n_azimuth": n_azimuth, "n_range": n_range} for method in timed]
            ratio = float(np.median(measured.ratios(ADAPTIVE, CONVENTIONAL)))
            required.append(
                at_most(f"scene {case}: adaptive over conventional PGA, median of {len(measured.seconds[ADAPTIVE])} rounds", ratio, ALLOWED)
            )
            del image, measured
            if progress is not None:
                progress("luo2025-table8", number * len(scenes.SCENES) + place + 1, len(sizes) * len(scenes.SCENES))
    parameters = {
        "seed": seed, "sizes": "range x azimuth", "round_trip": "azimuth_compress: transform, phase, transform back",
        "do_no_harm": "only of the methods named judged",
        "memory": "peak resident over that before any call, in sizes of the image; image, output left out", "rounds": list(rounds),
        "rounds_beside": rounds_beside, "budget": list(budget), "error": ERROR, "k": "the default, 128",
    }  # fmt: skip
    return Reproduction(name="luo2025-table8", parameters=parameters, rows=rows, required=required)


def large(scene: str, shape: tuple[int, int], generator: np.random.Generator) -> ComplexArray:
    """Return a scene under an error: the texture repeated, transforms in single precision; 134 million pixels take half a minute."""
    statistics = scenes.STATISTICS[scene]
    tile = (min(TILE, shape[0]), min(TILE, shape[1]))
    spread = np.sqrt(0.5 * scenes.texture(statistics, tile, generator)).astype(np.float32)
    image = np.empty(shape, dtype=np.complex64)
    for first in range(0, shape[0], tile[0]):
        for gate in range(0, shape[1], tile[1]):
            block = image[first : first + tile[0], gate : gate + tile[1]]
            white = generator.standard_normal((2, *block.shape), dtype=np.float32)
            block[...] = spread[: block.shape[0], : block.shape[1]] * (white[0] + 1j * white[1])
    scenes.add_points(image, statistics, generator)
    spectrum = scipy.fft.fft2(image, overwrite_x=True, workers=-1)
    phase = scenes.phase_error(ERROR, shape[0], generator)
    for start in range(0, shape[0], 256):
        rows = slice(start, start + 256)
        spectrum[rows] *= np.fft.ifftshift(scenes.full_error(np.fft.ifftshift(phase)[rows], shape[1]), axes=1)
    spectrum *= np.fft.ifftshift(scenes.inside(shape[1], scenes.RANGE_SHARE))
    spectrum[~np.fft.ifftshift(scenes.inside(shape[0], scenes.AZIMUTH_SHARE))] = 0.0
    made: ComplexArray = scipy.fft.ifft2(spectrum, overwrite_x=True, workers=-1)
    return made


def jobs(image: ComplexArray, threads: int) -> dict[str, Job]:
    """Return what is timed; the output is allocated once."""
    out = np.full_like(image, 0.0)  # touched: its pages are no job's memory
    common: dict[str, Any] = {"out": out, "threads": threads}
    geometry: StripmapGeometry = airborne(image.shape[1], 16000.0, 0.5)
    return {
        TRIP: lambda: azimuth_compress(image, geometry, **common),
        CONVENTIONAL: lambda: conventional_pga(image, do_no_harm=False, **common),
        ADAPTIVE: lambda: adaptive_pga(image, do_no_harm=False, **common),
        TWO_DIMENSIONAL: lambda: pga_2d(image, bandwidth_ratio=scenes.BANDWIDTH_RATIO, do_no_harm=False, **common),
        JUDGED_CONVENTIONAL: lambda: conventional_pga(image, **common),
        JUDGED_ADAPTIVE: lambda: adaptive_pga(image, **common),
    }


class Clock:
    """Times of jobs that take turns, and the memory that each needs."""

    def __init__(self, work: dict[str, Job], generator: np.random.Generator, size: int) -> None:
        self.work = work
        self.generator = generator
        self.size = size  # byte, of the image
        self.seconds: dict[str, list[float]] = {method: [] for method in work}
        self.memory: dict[str, float | None] = {}
        self.status: dict[str, str | None] = {}

    def run(self, rounds: int, rounds_beside: int, budget: float = np.inf) -> None:
        """Run the rounds; none but the first begins after `budget` seconds.

        The round before the first warms up and measures memory, in the order given: the least demanding first, because what a job
        leaves with the allocator counts for the next.
        """
        begun = time.perf_counter()
        base = status_of_process("VmRSS") if resets_peak() else None
        for turn in range(rounds + 1):
            if turn > 1 and time.perf_counter() - begun > budget:
                break
            quick = [method for method in self.work if method not in BESIDE]
            order = [str(method) for method in self.generator.permutation(quick)] if turn else quick
            beside = [method for method in self.work if method in BESIDE and 0 < turn <= rounds_beside]
            for method in beside + order:
                first = method not in self.memory
                measures = first and base is not None and resets_peak()
                started = time.perf_counter()
                result = self.work[method]()
                if turn:
                    self.seconds[method].append(time.perf_counter() - started)
                if first:
                    self.memory[method] = status_of_process("VmHWM") - base if measures and base is not None else None
                    self.status[method] = getattr(getattr(result, "status", None), "name", None)

    def ratios(self, method: str, other: str) -> list[float]:
        """Return the ratios within the rounds in which both ran."""
        return [ours / theirs for ours, theirs in zip(self.seconds[method], self.seconds[other], strict=False)]


def resets_peak() -> bool:
    """Reset the peak of resident memory to what is resident now; False where the system has no such thing."""
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    except OSError:
        return False
    return True


def status_of_process(field: str) -> float:
    """Return a field of the status of this process, byte."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024.0 * float(next(line.split()[1] for line in lines if line.startswith(field + ":")))


def published(scene: str, size: tuple[int, int]) -> dict[str, float]:
    """Return the paper's seconds by method; nothing for other sizes than its own."""
    if size not in SIZES:
        return {}
    return {
        method: column[SIZES.index(size)] for method, column in zip((CONVENTIONAL, ADAPTIVE, TWO_DIMENSIONAL), PAPER[scene], strict=True)
    }


def row(measured: Clock, method: str, case: str, quoted: dict[str, float]) -> dict[str, Any]:
    """Return seconds, multiples of a round trip and of conventional PGA, memory over the size of the image."""
    own = np.array(measured.seconds[method])
    memory = measured.memory[method]
    paper = quoted.get(method)
    over = measured.ratios(method, JUDGED_CONVENTIONAL if method == JUDGED_ADAPTIVE else CONVENTIONAL)
    return {
        "method": method, "case": case, "rounds": len(own), "status": measured.status[method],
        "seconds": float(np.median(own)), "from": float(own.min()), "to": float(own.max()),
        "round_trips": float(np.median(measured.ratios(method, TRIP))), "over_conventional": float(np.median(over)),
        "over_conventional_from": min(over), "over_conventional_to": max(over),
        "images_of_memory": None if memory is None else memory / measured.size,
        "paper_seconds": paper, "paper_over_conventional": None if paper is None else paper / quoted[CONVENTIONAL],
    }  # fmt: skip


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw the ratio and the multiples over the size; return the file written."""
    from ..report.figures import save  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.scene_figures import times_figure  # noqa: PLC0415

    path = folder / "luo2025_table8.png"
    save(times_figure(result.rows, ALLOWED), path)
    return [path]
