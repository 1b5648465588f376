"""Phase estimators against the Cramer-Rao bound: 16 lines of 512 pulses, one common phase, white noise [methods.md, section 3]."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import estimate_phase
from .model import Reproduction, at_most

N_LINE, N_PULSE = 16, 512
SNR_DB = (0.0, 5.0, 10.0, 20.0)
Estimator = Literal["ml", "gradient"]
ESTIMATORS: tuple[Estimator, ...] = ("ml", "gradient")
STANDARD_ERROR = 0.01  # of the RMSE, relative: the trials go on until it is reached
MIN_TRIALS, MAX_TRIALS = 24, 3000
ALLOWED = 1.1
SEED = 20230716
PHASE_RMS = 2.0  # rad, of the smooth error drawn anew for each trial
PHASE_CYCLES = 5  # highest harmonic of it
FloatArray = npt.NDArray[np.float64]


def run(*, seed: int = SEED, threads: int = 0, progress: Callable[[str, int, int], None] | None = None) -> Reproduction:
    """Run the trials; every signal-to-noise ratio uses the same stream of draws, continued."""
    rows: list[dict[str, Any]] = []
    for step, snr_db in enumerate(SNR_DB):
        for estimator in ESTIMATORS:
            generator = np.random.default_rng([seed, step])
            rows.append(_measure(estimator, snr_db, generator, threads))
            if progress is not None:
                progress("crlb", len(rows), len(SNR_DB) * len(ESTIMATORS))
    required = [at_most(f"ML RMSE over the bound at {row['snr_db']:g} dB", row["ratio"], ALLOWED) for row in rows if row["method"] == "ml"]
    parameters = {
        "n_line": N_LINE,
        "n_pulse": N_PULSE,
        "snr_db": list(SNR_DB),
        "seed": seed,
        "relative_standard_error": STANDARD_ERROR,
        "max_trials": MAX_TRIALS,
        "phase_rms": PHASE_RMS,
        "phase_cycles": PHASE_CYCLES,
        "bound": "sqrt(1 / (2 n_line snr))",
    }
    return Reproduction(name="crlb", parameters=parameters, rows=rows, required=required)


def bound(snr_db: float) -> float:
    """Return the Cramer-Rao bound of the phase of one pulse, rad."""
    return float(np.sqrt(1.0 / (2.0 * N_LINE * 10.0 ** (snr_db / 10.0))))


def _measure(estimator: Estimator, snr_db: float, generator: np.random.Generator, threads: int) -> dict[str, Any]:
    squares: list[float] = []
    while len(squares) < MAX_TRIALS:
        lines, truth = trial(snr_db, generator)
        estimate = estimate_phase(lines, estimator=estimator, threads=threads)
        squares.append(float(np.mean(without_line(np.asarray(estimate.phase) - truth) ** 2)))
        if len(squares) >= MIN_TRIALS and _standard_error(squares) <= STANDARD_ERROR:
            break
    rmse = float(np.sqrt(np.mean(squares)))
    return {
        "method": estimator,
        "case": f"{snr_db:g} dB",
        "snr_db": snr_db,
        "rmse": rmse,
        "bound": bound(snr_db),
        "ratio": rmse / bound(snr_db),
        "standard_error": rmse * _standard_error(squares),
        "trials": len(squares),
    }


def trial(snr_db: float, generator: np.random.Generator) -> tuple[npt.NDArray[np.complex64], FloatArray]:
    """One trial: unit lines of random phase with a common smooth phase, and noise of the power that the ratio says."""
    truth = smooth_phase(N_PULSE, PHASE_RMS, PHASE_CYCLES, generator)
    amplitude = np.exp(2j * np.pi * generator.random((N_LINE, 1)))
    noise = generator.standard_normal((2, N_LINE, N_PULSE)) * np.sqrt(0.5 * 10.0 ** (-snr_db / 10.0))
    return (amplitude * np.exp(1j * truth) + noise[0] + 1j * noise[1]).astype(np.complex64), truth


def smooth_phase(n_pulse: int, rms: float, cycles: int, generator: np.random.Generator) -> FloatArray:
    """Random sum of the first `cycles` harmonics of the aperture, of the given RMS (rad), constant and line removed."""
    aperture = np.arange(n_pulse) / n_pulse
    harmonics = np.arange(1, cycles + 1)[:, None]
    weights, phases = generator.standard_normal((cycles, 1)), 2.0 * np.pi * generator.random((cycles, 1))
    phase = without_line((weights * np.cos(2.0 * np.pi * harmonics * aperture + phases)).sum(axis=0))
    scale = rms / float(np.sqrt(np.mean(phase**2)))
    return scale * phase


def without_line(phase: FloatArray) -> FloatArray:
    """Return the phase without its least-squares constant and line: the gauge in which phases are compared."""
    x = np.linspace(-1.0, 1.0, len(phase))
    centred = phase - phase.mean()
    straight: FloatArray = centred - x * (float(x @ centred) / float(x @ x))
    return straight


def _standard_error(squares: list[float]) -> float:
    """Relative standard error of the root of the mean of `squares`."""
    return float(np.std(squares, ddof=1) / (2.0 * np.sqrt(len(squares)) * np.mean(squares)))


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw the error over the signal-to-noise ratio; return the file written."""
    from ..report.figures import bound_figure, save  # noqa: PLC0415  matplotlib only where a picture is wanted

    path = folder / "crlb.png"
    save(bound_figure(result.rows), path)
    return [path]
