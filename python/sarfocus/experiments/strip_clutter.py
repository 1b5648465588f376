"""Strong points in clutter under a known phase error: how much of the focus comes back, and whether phase_std says what is left.

Gaussian clutter, band-limited to the Doppler bandwidth, and points at random places. The entropy of sparse bright points depends on
where they fall between the pixels, and so on the gauge: an estimate is brought to the gauge of the truth before it is scored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import StripmapGeometry, azimuth_compress, quality, simulate, spga_linear, strip
from .crlb import smooth_phase, without_line
from .model import Reproduction, Requirement, at_least, at_most
from .strips import ComplexArray, FloatArray, airborne, aligned, described, piecewise_linear, slope_of_shift
from .xie2023 import SHIFTS

N_AZIMUTH, N_RANGE = 4096, 512
RANGE_START, RANGE_SPACING = 16000.0, 0.5  # m: apertures of 1875 samples and more
CASES = ((15, 35.0, 0.35), (40, 25.0, 0.15), (80, 20.0, 0.25))  # points; their peak over the clutter, dB; allowed RMSE, rad
ERRORS = ("piecewise linear", "smooth")
SMOOTH_RMS, SMOOTH_CYCLES = 3.0, 8  # rad; cycles over the strip
DRAWS = 3
RECOVERED, RECOVERED_MEAN = 0.90, 0.94
STD_TRIALS = 200
STD_AZIMUTH, STD_RANGE, STD_START = 1024, 64, 3000.0  # of the smaller strip; m
STD_POINTS, STD_PEAK_DB = 20, 25.0
WITHIN, WITHIN_TOLERANCE = 0.95, 0.03  # share of samples within two standard deviations
SEED = 40962
Progress = Callable[[str, int, int], None] | None


@dataclass
class Draw:
    """A strip with clutter and points, without and with a phase error."""

    geometry: StripmapGeometry
    points: list[tuple[float, int]]  # azimuth in pixels, range gate
    phase_error: FloatArray
    truth: ComplexArray
    image: ComplexArray


@dataclass
class Found:
    """What autofocus found, in the gauge of the truth, on the samples that an aperture reaches."""

    estimate: FloatArray
    deviation: FloatArray
    error: FloatArray
    row: dict[str, Any]


def run(*, seed: int = SEED, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Run every case with both errors, several draws of each, then the trials that judge phase_std."""
    rows: list[dict[str, Any]] = []
    pictures: dict[str, Any] = {"phases": []}
    inside: list[npt.NDArray[np.bool_]] = []
    total = len(CASES) * len(ERRORS) * DRAWS
    for number, (name, draw) in enumerate(draws(seed, threads), start=1):
        found = focus(draw, threads, image_too=True)
        rows.append({"method": "spga_linear"} | name | found.row)
        inside.append(np.abs(found.error) <= 2.0 * found.deviation[np.isfinite(found.deviation)])
        if name["draw"] == 1:
            title = f"{name['case']}, {name['error']}"
            pictures["phases"].append((title, without_line(draw.phase_error), in_same_gauge(found, draw), found.deviation))
        if name["draw"] == 1 and name["points"] == CASES[1][0] and name["error"] == ERRORS[0]:
            pictures |= crops(draw, found, threads)
        if progress is not None:
            progress("strip-clutter", number, total)
    share = float(np.mean(np.concatenate(inside)))
    trials = std_trials(seed, threads, progress)
    rows.append(trials)
    parameters = {
        "n_azimuth": N_AZIMUTH, "n_range": N_RANGE, "seed": seed, "draws": DRAWS, "shifts": list(SHIFTS),
        "smooth_rms": SMOOTH_RMS, "smooth_cycles": SMOOTH_CYCLES, "within_two_std_of_all_draws": share,
        "gauge": "constant and line of the truth, before entropy and RMSE are taken", "rmse": "over the samples that an aperture reaches",
        "small_strip": {"n_azimuth": STD_AZIMUTH, "n_range": STD_RANGE, "range_start": STD_START, "trials": STD_TRIALS,
                        "points": STD_POINTS, "peak_to_clutter_db": STD_PEAK_DB},
    }  # fmt: skip
    parameters |= described(airborne(N_RANGE, RANGE_START, RANGE_SPACING))
    return Reproduction(name="strip-clutter", parameters=parameters, rows=rows, required=required(rows), pictures=pictures)


def draws(seed: int, threads: int) -> Iterator[tuple[dict[str, Any], Draw]]:
    """Yield what every draw is called and the draw; all of them have seeds of their own, derived from `seed`."""
    geometry = airborne(N_RANGE, RANGE_START, RANGE_SPACING)
    for case, (n_point, peak_db, _) in enumerate(CASES):
        for kind, error in enumerate(ERRORS):
            for draw in range(1, DRAWS + 1):
                generator = np.random.default_rng([seed, case, kind, draw])
                phase = piecewise(geometry, N_AZIMUTH) if error == ERRORS[0] else smooth(N_AZIMUTH, generator)
                name = {"case": f"{n_point} points at {peak_db:g} dB", "points": n_point, "error": error, "draw": draw}
                yield name, make(geometry, phase, generator, n_point=n_point, peak_db=peak_db, threads=threads)


def piecewise(geometry: StripmapGeometry, n_azimuth: int) -> FloatArray:
    """Return the error of seven even pieces that displace a point in the middle of the swath as in table 3 of the paper."""
    gate = len(geometry.slant_range) // 2
    ends = np.arange(1, len(SHIFTS)) * n_azimuth / len(SHIFTS)
    return piecewise_linear(n_azimuth, ends, [slope_of_shift(geometry, shift, gate) for shift in SHIFTS])


def smooth(n_azimuth: int, generator: np.random.Generator) -> FloatArray:
    """Return a smooth random error."""
    return smooth_phase(n_azimuth, SMOOTH_RMS, SMOOTH_CYCLES, generator)


def make(
    geometry: StripmapGeometry, phase_error: FloatArray, generator: np.random.Generator, *, n_point: int, peak_db: float, threads: int = 0
) -> Draw:
    """Simulate clutter of unit power and points, one in each of equal parts of the strip; gates at random, none twice if they suffice."""
    n_azimuth, n_range = len(phase_error), len(geometry.slant_range)
    azimuth = (np.arange(n_point) + generator.uniform(0.1, 0.9, n_point)) * n_azimuth / n_point
    gates = generator.choice(n_range, n_point, replace=n_point > n_range)
    points = [(float(u), int(g)) for u, g in zip(azimuth, gates, strict=True)]
    strength = 10.0 ** (peak_db / 20.0) * np.exp(2j * np.pi * generator.random(n_point))
    seed = int(generator.integers(2**32))
    raw = simulate.stripmap(geometry, points, strength, n_azimuth=n_azimuth, clutter_power=1.0, seed=seed, threads=threads)
    truth = azimuth_compress(raw, geometry, threads=threads)
    raw *= np.exp(1j * phase_error)[:, None].astype(np.complex64)
    return Draw(geometry, points, phase_error, truth, azimuth_compress(raw, geometry, threads=threads))


def focus(draw: Draw, threads: int, *, image_too: bool) -> Found:
    """Run autofocus on a draw and score it; the entropy only where `image_too`."""
    result = spga_linear(draw.image, draw.geometry, threads=threads)
    deviation = np.asarray(result.phase_std)
    reached = np.isfinite(deviation)
    estimate = aligned(np.asarray(result.phase_error), draw.phase_error, reached)
    error = (estimate - draw.phase_error)[reached]
    row: dict[str, Any] = {"status": result.status.name, "rmse": float(np.sqrt(np.mean(error**2)))}
    row |= {"phase_std": float(np.sqrt(np.mean(deviation[reached] ** 2)))}
    row |= {"within_two_std": float(np.mean(np.abs(error) <= 2.0 * deviation[reached])), "reached": float(np.mean(reached))}
    if image_too:
        image = strip.azimuth_correct(draw.image, draw.geometry, estimate, threads=threads)
        before, after, ideal = (quality.entropy(one, threads=threads) for one in (draw.image, image, draw.truth))
        row["recovered"] = (before - after) / (before - ideal)
    return Found(estimate, deviation, error, row)


def in_same_gauge(found: Found, draw: Draw) -> FloatArray:
    """Return the estimate less the line that `without_line` takes off the truth."""
    return found.estimate - draw.phase_error + without_line(draw.phase_error)


def std_trials(seed: int, threads: int, progress: Progress) -> dict[str, Any]:
    """Run many trials on a small strip: the share of samples within two standard deviations, and both figures' means."""
    geometry = airborne(STD_RANGE, STD_START, RANGE_SPACING)
    squares, variances, inside = [], [], []
    for trial in range(STD_TRIALS):
        generator = np.random.default_rng([seed, len(CASES), trial])
        phase = smooth(STD_AZIMUTH, generator)
        made = make(geometry, phase, generator, n_point=STD_POINTS, peak_db=STD_PEAK_DB, threads=threads)
        found = focus(made, threads, image_too=False)
        squares.append(np.mean(found.error**2))
        variances.append(np.nanmean(found.deviation**2))
        inside.append(found.row["within_two_std"])
        if progress is not None:
            progress("phase_std", trial + 1, STD_TRIALS)
    case = f"small strip, {STD_POINTS} points at {STD_PEAK_DB:g} dB"
    row: dict[str, Any] = {"method": "spga_linear", "case": case, "points": STD_POINTS, "error": ERRORS[1], "draw": None, "status": None}
    row |= {"rmse": float(np.sqrt(np.mean(squares))), "phase_std": float(np.sqrt(np.mean(variances)))}
    return row | {"within_two_std": float(np.mean(inside)), "reached": None, "recovered": None}


def required(rows: list[dict[str, Any]]) -> list[Requirement]:
    """Return the bounds: of the largest RMSE of a case, of the entropy recovered in every draw and on average, of phase_std."""
    scored = [row for row in rows if row["recovered"] is not None]
    out = []
    for n_point, peak_db, allowed in CASES:
        found = np.array([row["rmse"] for row in scored if row["points"] == n_point])
        together = float(np.sqrt(np.mean(found**2)))
        what = f"{n_point} points at {peak_db:g} dB: largest phase RMSE of {len(found)} draws, rad ({together:.3f} over all of them)"
        out.append(at_most(what, float(found.max()), allowed))
    recovered = [row["recovered"] for row in scored]
    out.append(at_least("smallest share of the entropy recovered", min(recovered), RECOVERED))
    out.append(at_least("mean share of the entropy recovered", float(np.mean(recovered)), RECOVERED_MEAN))
    share = next(row["within_two_std"] for row in rows if row["recovered"] is None)
    what = f"share of samples within two standard deviations, {STD_TRIALS} trials: distance from {WITHIN}"
    return [*out, at_most(what, abs(share - WITHIN), WITHIN_TOLERANCE)]


def crops(draw: Draw, found: Found, threads: int) -> dict[str, Any]:
    """Return what the pictures of the image show."""
    after = strip.azimuth_correct(draw.image, draw.geometry, found.estimate, threads=threads)
    inner = [point for point in draw.points if 24 <= point[1] < N_RANGE - 24]
    places = [inner[k] for k in np.linspace(1, len(inner) - 2, 5).astype(int)]
    return {"images": {"before": draw.image, "after": after, "error-free": draw.truth}, "places": places}


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw the phases with their bands, the strip and the surroundings of some points; return the files written."""
    from ..report import strip_figures as figures  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.figures import save  # noqa: PLC0415

    held = result.pictures
    spacing = (result.parameters["velocity"] / result.parameters["prf"], RANGE_SPACING)
    made = {
        "phase": figures.band_figure(held["phases"]),
        "strip": figures.strip_figure(held["images"], spacing, held["places"]),
        "points": figures.crops_figure(held["images"], held["places"]),
    }
    paths = [folder / f"strip_clutter_{name}.png" for name in made]
    for picture, path in zip(made.values(), paths, strict=True):
        save(picture, path)
    return paths
