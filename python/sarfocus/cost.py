"""What a call costs in time and memory, from sizes alone, before it is made.

Time is counted in what the machine at hand does in a moment: transforms there and back along azimuth, and pixels times pulses of
exact backprojection. What autofocus takes depends on the scene, too: these are the figures of clutter with many strong points, judged and
corrected.
The coefficients in ``cost.json`` are fitted and checked by ``bench/python/cost_model.py``.
"""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources

import numpy as np

from . import FactorizedReport, ImageGrid, StripmapGeometry, azimuth_compress, backproject, method_names, plan_factorized
from ._core import available_memory
from .io import Image, PhaseHistory
from .memory import SAMPLE_BYTES

LOOKED_AT, SHARE = 512, 8  # an estimate is made from so many range gates, or from one in so many where that is more
SCORED = 4  # auto scores on one in so many
SMALL = 1 << 20  # pixels of an image that is looked at as a whole
REPEATS = 5
MACHINE_SHAPE = (4096, 768)  # azimuth lines, range gates
MACHINE_GRID, MACHINE_PULSES = 320, 384
Terms = dict[str, float]


@dataclass(frozen=True)
class Cost:
    """Time, s, and memory beyond input and output, bytes."""

    seconds: float
    memory: int


@dataclass(frozen=True)
class Machine:
    """How long this machine takes, all threads together.

    Attributes
    ----------
    transform : float
        s, there and back, for a sample and each doubling of the length of its line.
    pixel_pulse : float
        s, of exact backprojection onto a plane.
    """

    transform: float
    pixel_pulse: float


@functools.lru_cache
def machine(threads: int = 0) -> Machine:
    """Measure this machine, which takes a third of a second, once."""
    return measure_machine(threads)


def measure_machine(threads: int = 0) -> Machine:
    """Measure this machine now."""
    n_azimuth, n_range = MACHINE_SHAPE
    image = np.ones((n_range, n_azimuth), np.complex64).T
    out = np.ones_like(image)
    geometry = StripmapGeometry(wavelength=0.03, prf=500.0, velocity=100.0, slant_range=1e4 + np.arange(n_range), doppler_bandwidth=400.0)
    transforms = shortest(lambda: azimuth_compress(image, geometry, out=out, threads=threads))
    track = np.stack([np.linspace(-50.0, 50.0, MACHINE_PULSES), np.full(MACHINE_PULSES, -4000.0), np.full(MACHINE_PULSES, 2000.0)], axis=1)
    corner = -0.2 * MACHINE_GRID
    grid = ImageGrid.plane((corner, corner, 0.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (MACHINE_GRID, MACHINE_GRID))
    data = np.ones((MACHINE_PULSES, 500), np.complex64)
    sums = shortest(lambda: backproject(data, track, grid, range_start=4372.0, range_spacing=0.4, wavelength=0.03, threads=threads))
    return Machine(transforms / (image.size * float(np.log2(n_azimuth))), sums / (MACHINE_GRID**2 * MACHINE_PULSES))


def shortest(call: Callable[[], object]) -> float:
    """Return the shortest time of a few calls, s."""
    seconds = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - started)
    return min(seconds)


def image_terms(shape: tuple[int, int], on: Machine, method: str) -> tuple[Terms, Terms]:
    """Seconds of a round trip, and bytes, of each kind of work of a method of autofocus, or of "auto".

    The whole image; the gates an estimate looks at; as many lines; points, whose number may grow with the length; what no size tells.
    """
    n_azimuth, n_range = shape
    gates, lines = min(n_range, max(LOOKED_AT, n_range // (SCORED if method == "auto" else SHARE))), min(n_azimuth, LOOKED_AT)
    samples = {"image": n_azimuth * n_range, "gates": n_azimuth * gates, "lines": lines * n_range}
    samples |= {"points": n_azimuth**2, "once": LOOKED_AT**2}
    each = max(float(np.log2(n_azimuth)), 1.0) * on.transform
    return {name: n * each for name, n in samples.items()}, {name: float(n * SAMPLE_BYTES) for name, n in samples.items()}


def backproject_terms(
    history: PhaseHistory, grid: ImageGrid, method: str, on: Machine, *, target_error_db: float = -60.0
) -> tuple[Terms, Terms]:
    """Seconds of the sum over pulses and of a round trip of all profiles; bytes of the image, all profiles, one, and a sample of each."""
    n_pulse, n_range = history.data.shape
    pixels, profiles = float(grid.shape[0] * grid.shape[1]), float(n_pulse * n_range)
    seconds = {"sum": pixels * n_pulse * on.pixel_pulse, "profiles": profiles * max(float(np.log2(n_range)), 1.0) * on.transform}
    plan = plan_of(history, grid, target_error_db) if method == "ffbp" else None
    if plan is None:
        memory = {"profile": float(n_range), "once": float(LOOKED_AT**2)}
        if method == "gpga":
            memory |= {"image": pixels, "profiles": profiles, "pulses": float(n_pulse)}
        return seconds, {name: n * SAMPLE_BYTES for name, n in memory.items()}
    memory = {"plan": float(plan.memory), "profile": float(n_range * SAMPLE_BYTES), "once": float(LOOKED_AT**2 * SAMPLE_BYTES)}
    return seconds | {"sum": seconds["sum"] * plan.work, "once": LOOKED_AT**2 * on.transform}, memory


def plan_of(history: PhaseHistory, grid: ImageGrid, target_error_db: float) -> FactorizedReport | None:
    """Return the plan of factorised backprojection; None where it would sum exactly."""
    plan = plan_factorized(
        history.antenna,
        grid,
        n_range=history.data.shape[1],
        range_start=history.range_start,
        range_spacing=history.range_spacing,
        wavelength=history.wavelength,
        target_error_db=target_error_db,
    )
    return plan if plan.factorized else None


def image_job(method: str, shape: tuple[int, int], *, strip: bool = False) -> str:
    """Return what the coefficients of a method of autofocus are called."""
    return ("strip " if strip else "") + method + (", small" if shape[0] * shape[1] <= SMALL else "")


@functools.cache
def coefficients() -> dict[str, dict[str, Terms]]:
    """Return what multiplies the terms, for every method: of seconds and of bytes."""
    held: dict[str, dict[str, Terms]] = json.loads(resources.files(__package__).joinpath("cost.json").read_text(encoding="utf-8"))
    return held


def predicted(name: str, seconds: Mapping[str, float], memory: Mapping[str, float]) -> Cost:
    """Return the sums of terms times coefficients."""
    by = coefficients()[name]
    return Cost(
        sum(by["seconds"].get(term, 0.0) * value for term, value in seconds.items()),
        round(sum(by["memory"].get(term, 0.0) * value for term, value in memory.items())),
    )


def autofocus_cost(method: str, shape: tuple[int, int], *, strip: bool, threads: int = 0, on: Machine | None = None) -> Cost:
    """Predict the cost of a method of `sarfocus.autofocus`, or of "auto".

    Parameters
    ----------
    method : str
    shape : (int, int)
        Azimuth lines and range gates.
    strip : bool
        Whether the image comes with the geometry of a strip.
    threads : int
    on : Machine, optional
        By default the one at hand.

    Returns
    -------
    Cost

    Raises
    ------
    ValueError
        No such method.
    """
    known = ("auto", *method_names(strip=strip))
    if method not in known:
        raise ValueError(f"method: expected one of {', '.join(known)}, got {method!r}")
    return predicted(image_job(method, shape, strip=strip), *image_terms(shape, on or machine(threads), method))


def backproject_cost(
    history: PhaseHistory,
    grid: ImageGrid,
    method: str = "exact",
    *,
    target_error_db: float = -60.0,
    threads: int = 0,
    on: Machine | None = None,
) -> Cost:
    """Predict the cost of `sarfocus.backproject` ("exact", "ffbp") or of `sarfocus.gpga` ("gpga").

    Parameters
    ----------
    history : PhaseHistory
    grid : ImageGrid
    method : str
    target_error_db : float
        Of "ffbp".
    threads : int
    on : Machine, optional
        By default the one at hand.

    Returns
    -------
    Cost

    Raises
    ------
    ValueError
        No such method, or no trajectory.
    """
    if method not in ("exact", "ffbp", "gpga"):
        raise ValueError(f"method: expected exact, ffbp or gpga, got {method!r}")
    if method == "exact" and grid.kind == "points":
        method = "points"
    terms = backproject_terms(history, grid, method, on or machine(threads), target_error_db=target_error_db)
    if method == "ffbp" and "plan" not in terms[1]:
        method = "exact"
    return predicted(method if method == "gpga" else f"backproject {method}", *terms)


def costs(item: PhaseHistory | Image, grid: ImageGrid | None = None, *, threads: int = 0) -> dict[str, Cost]:
    """Predict every method that fits: of autofocus for an image, of backprojection onto a grid for a phase history."""
    if isinstance(item, Image):
        rows, columns = item.data.shape
        strip = item.geometry is not None
        names = ("auto", *method_names(strip=strip))
        return {name: autofocus_cost(name, (rows, columns), strip=strip, threads=threads) for name in names}
    if grid is None:
        raise ValueError("grid: expected the pixels to form from a phase history")
    return {name: backproject_cost(item, grid, name, threads=threads) for name in ("exact", "ffbp", "gpga")}


def fits(cost: Cost, output: int = 0) -> bool:
    """Whether so much memory, and so many bytes of output, are free now; True where the system doesn't say."""
    free = available_memory()
    return not free or cost.memory + output <= free
