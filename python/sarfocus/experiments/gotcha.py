"""Autofocus by backprojection on measured phase history: known errors injected into AFRL Gotcha data, degrees 1 and 2 of pass 1.

The untouched data, formed as they are, are the truth: they are well focused. What the same call finds on them is the data's own residual.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import ImageGrid, Result, Status, backproject, gpga
from ..io import PhaseHistory, read
from .crlb import without_line
from .model import Reproduction, Requirement, at_most

FILES = tuple(f"gotcha/data_3dsar_pass1_az{degree:03d}_HH.mat" for degree in (1, 2))
PIXEL = 0.15  # m
HALF_SIZE = 50.0  # m, of the useful scene
REFLECTORS = ((-16.0, 21.0, 0.0), (-28.0, 38.5, 0.0))  # m, to a metre or so
SEARCH = ((0.1, 3.0), (0.02, 0.3), (0.002, 0.03))  # m, step and half width of the successive grids that place a peak
SEED = 1
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """An injected error: a phase on the data, or a displacement of the antenna that the processor assumes."""

    name: str
    phase: FloatArray  # rad [n_pulse]
    displacement: FloatArray  # m [n_pulse, 3]


@dataclass(frozen=True)
class Peak:
    """A reflector's peak."""

    level_db: float
    position: FloatArray  # m


def run(
    *,
    data: str | os.PathLike[str] | None = None,
    seed: int = SEED,
    threads: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Reproduction:
    """Run all cases.

    Parameters
    ----------
    data : path, optional
        Folder that holds ``gotcha/data_3dsar_pass1_az001_HH.mat`` and ``…002…``; by default ``$SARFOCUS_DATA``.
    seed : int
        Of the random walk.

    Raises
    ------
    ValueError
        No such files.
    """
    history = read(_files(data))
    if not isinstance(history, PhaseHistory) or history.positions is None:
        raise ValueError("data: expected phase history with antenna positions")
    n = round(2.0 * HALF_SIZE / PIXEL)
    grid = ImageGrid.plane((-HALF_SIZE, -HALF_SIZE, 0.0), (0.0, PIXEL, 0.0), (PIXEL, 0.0, 0.0), (n, n))
    truth = [find_peak(history, history.phase_centres, history.data, np.asarray(place)) for place in REFLECTORS]
    rows: list[dict[str, Any]] = []
    required: list[Requirement] = []
    own: FloatArray | None = None
    listed = cases(history, seed)
    for done, case in enumerate(listed):
        row, estimate = _measure(history, grid, case, own=own, truth=truth, threads=threads)
        own = estimate if own is None else own
        rows.append(row)
        required += _required(row)
        if progress is not None:
            progress("gotcha", done + 1, len(listed))
    parameters = {
        "pixel": PIXEL,
        "half_size": HALF_SIZE,
        "files": [Path(f).name for f in FILES],
        "seed": seed,
        "reflectors": [list(p) for p in REFLECTORS],
    }
    return Reproduction(name="gotcha", parameters=parameters, rows=rows, required=required)


def cases(history: PhaseHistory, seed: int) -> list[Case]:
    """Return the untouched data and the four errors of known size."""
    n_pulse = len(history.data)
    t = np.linspace(-1.0, 1.0, n_pulse)
    still = np.zeros((n_pulse, 3))
    walk = without_line(np.cumsum(np.random.default_rng(seed).standard_normal(n_pulse)))
    sway = 0.02 * np.sin(2.6 * np.pi * t)[:, None] * np.array([0.6, 0.48, 0.64])  # 2 cm along a slanting line
    return [
        Case("untouched", np.zeros(n_pulse), still),
        Case("quadratic, 10 rad", 10.0 * t**2, still),
        Case("sinusoid, 3 cycles, 4 rad", 4.0 * np.sin(3.0 * np.pi * t), still),
        Case("random walk, 6 rad", 6.0 * walk / np.abs(walk).max(), still),
        Case("trajectory, 2 cm", np.zeros(n_pulse), sway),
    ]


def phase_of(history: PhaseHistory, case: Case) -> FloatArray:
    """Return the phase error of the case at the scene centre, rad: 4 pi / lambda times the range the processor takes to be too long."""
    true = np.linalg.norm(history.phase_centres, axis=1)
    assumed = np.linalg.norm(history.phase_centres + case.displacement, axis=1)
    error: FloatArray = case.phase + 4.0 * np.pi / history.wavelength * (assumed - true)
    return error


def residual(found: FloatArray, truth: FloatArray) -> float:
    """RMS of the difference, gauge removed, modulo whole turns, rad."""
    difference = np.exp(1j * (found - truth))
    n = len(difference)
    turns = np.argmax(np.abs(np.fft.fft(difference, 64 * n))) / (64 * n)  # the line, even where it runs through whole turns
    flat = difference * np.exp(-2j * np.pi * turns * np.arange(n))
    return float(np.std(without_line(np.angle(flat * np.exp(-1j * np.angle(flat.mean()))))))


def find_peak(history: PhaseHistory, positions: FloatArray, data: npt.NDArray[np.complex64], place: FloatArray) -> Peak:
    """Place a peak by backprojection on ever finer grids round it."""
    level = 0.0
    for step, half_width in SEARCH:
        count = 2 * round(half_width / step) + 1
        origin = place - 0.5 * (count - 1) * np.array([step, step, 0.0])
        chip = ImageGrid.plane(origin, (step, 0.0, 0.0), (0.0, step, 0.0), (count, count))
        amplitude = np.abs(
            backproject(
                data,
                positions,
                chip,
                range_start=history.range_start,
                range_spacing=history.range_spacing,
                wavelength=history.wavelength,
            )
        )
        row, column = np.unravel_index(np.argmax(amplitude), amplitude.shape)
        place, level = np.asarray(chip.position(float(row), float(column))), float(amplitude[row, column])
    return Peak(20.0 * float(np.log10(level)), place)


def _files(data: str | os.PathLike[str] | None) -> list[Path]:
    named = data if data is not None else os.environ.get("SARFOCUS_DATA")
    if named is None:
        raise ValueError("data: expected the folder that holds gotcha/*.mat, by --data or in SARFOCUS_DATA, got none")
    return [Path(named) / file for file in FILES]


def _measure(
    history: PhaseHistory, grid: ImageGrid, case: Case, *, own: FloatArray | None, truth: list[Peak], threads: int
) -> tuple[dict[str, Any], FloatArray]:
    positions = history.phase_centres + case.displacement
    data = (history.data * np.exp(1j * case.phase)[:, None]).astype(np.complex64)
    result: Result = gpga(
        data,
        positions,
        grid,
        range_start=history.range_start,
        range_spacing=history.range_spacing,
        wavelength=history.wavelength,
        threads=threads,
    )
    injected = phase_of(history, case)
    estimate = np.asarray(result.estimate)
    corrected = (data * np.exp(-1j * np.asarray(result.phase_error))[:, None]).astype(np.complex64)
    peaks = [find_peak(history, positions, corrected, before.position) for before in truth]
    shifts = np.array([peak.position - before.position for peak, before in zip(peaks, truth, strict=True)])
    score = result.diagnostics["score"]
    row = {
        "method": "gpga",
        "case": case.name,
        "status": result.status.name,
        "injected_rms": float(np.std(without_line(injected))),
        "residual": residual(estimate, injected),
        "residual_beyond_own": residual(estimate, injected if own is None else injected + own),
        "phase_std": float(np.sqrt(np.nanmean(np.asarray(result.phase_std) ** 2))),
        "peak_change_db": [peak.level_db - before.level_db for peak, before in zip(peaks, truth, strict=True)],
        "largest_shift": float(np.linalg.norm(shifts - shifts.mean(axis=0), axis=1).max()),
        "entropy_before": score["entropy_before"],
        "entropy_after": score["entropy_after"],
        "reason": score["reason"],
    }
    return row, estimate


def _required(row: dict[str, Any]) -> list[Requirement]:
    name = row["case"]
    if name == "untouched":
        worst = 0.0 if row["status"] == Status.not_improved.name else -min(row["peak_change_db"])
        return [at_most("untouched: loss of the worse reflector, dB", worst, 0.0)]
    return [
        at_most(f"{name}: residual, rad", row["residual"], 0.15),
        at_most(f"{name}: residual beyond the data's own, rad", row["residual_beyond_own"], 0.08),
        at_most(f"{name}: change of a reflector's peak, dB", max(abs(change) for change in row["peak_change_db"]), 0.1),
        at_most(f"{name}: shift of a reflector, common shift removed, m", row["largest_shift"], 0.05),
    ]
