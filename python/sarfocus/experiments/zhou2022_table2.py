"""Motion compensation by sub-images against PGA and BP-FMSA on three points far apart in range [Zhou2022, table 2].

The motion is estimated from the points at 50 and 60 km; all three are imaged. A common shift of the scene along the track is the gauge of
every such estimate: points are measured where they are brightest. Besides: other draws of the error, one of height and cross-track
displacement together, a beam of fixed width, folded against literal reconstruction, and its time.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import ImageGrid, hrws
from . import zhou2022 as geometry
from .model import Reproduction, Requirement, at_most
from .zhou2022 import ComplexArray, FloatArray

SEED = 20220221
DRAWS = 5
REGION_SHAPE, REGION_STEP = (13, 13), 0.25  # m: 3 m either way
REGION_OFF = ((0.4, 0.6), (-0.3, -0.5))  # m, ground range and along the track, of the chips from their points
PHASE_REGION = (128, 32)  # of the chip at 50 km that PGA and BP-FMSA estimate from
BEAM_PULSES = 480  # more than see the point at 70 km in a beam of fixed width
TOLERANCE_DB, AMBIGUITY_DB, AGREEMENT_DB, TIME_RATIO = 0.05, -60.0, -50.0, 1.3
TIME_SHAPE, ROUNDS = (256, 256), 7
BAND: dict[str, Any] = {"doppler_bandwidth": geometry.DOPPLER_BANDWIDTH}
CASES = tuple(f"{x / 1e3:g} km" for x in geometry.GROUND_RANGES)
FREE, NONE, PGA, BP_FMSA, SI_MEC = "error-free", "none", "PGA", "BP-FMSA", "SI-MEC"
PAPER = {
    NONE: ((-6.49, 8.74), (-9.35, 4.74), (-10.60, 2.33)),
    PGA: ((-16.38, -3.47), (-1.04, 14.61), (-2.32, 14.08)),
    BP_FMSA: ((-12.64, -8.13), (-12.64, -8.13), (-12.47, -6.51)),
    SI_MEC: ((-13.26, -9.83), (-13.27, -9.83), (-13.27, -9.83)),
}  # PSLR, ISLR, dB
Progress = Callable[[str, int, int], None] | None
Rows = list[dict[str, Any]]


def run(*, seed: int = SEED, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Run the table; the seed draws the motion error, the other draws have the seeds behind it."""
    steps = 5 + DRAWS + 3
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress("zhou2022-table2", done, steps)

    truth = geometry.height_error(seed)
    rows, images = [], {}
    found: hrws.SiMecResult | None = None
    free = geometry.simulated(geometry.GROUND_RANGES, np.zeros_like(truth), threads)
    images[FREE] = hrws.reconstruct(free, grid(), threads=threads, **BAND)
    del free
    step()
    echo = geometry.simulated(geometry.GROUND_RANGES, truth, threads)
    for method in (NONE, PGA, BP_FMSA, SI_MEC):
        images[method], found = compensated(method, echo, threads)
        step()
    assert found is not None
    del echo
    for method, image in images.items():
        rows += table_rows(method, image)
    others = [other_draw(seed + 1 + n, threads, step) for n in range(DRAWS)]
    rows += [row for other in others for row in other]
    both, both_found = cross_track_draw(seed + DRAWS + 1, threads)
    step()
    beam = fixed_beam(truth_seed=seed, threads=threads)
    step()
    difference, seconds = reconstructions(threads), times(truth, threads)
    step()
    rows += both + beam
    parameters = described(seed) | {
        "motion": told(found),
        "motion_rms_wavelengths": motion_rms(found.motion, truth),
        "cross_track_motion": told(both_found),
        "folded_over_literal_db": difference,
        "time": seconds,
    }
    required = bounds(rows) + [
        at_most(f"folded less literal reconstruction, {case}, dB of the image", level, AGREEMENT_DB) for case, level in difference.items()
    ]
    required.append(
        at_most("folded reconstruction over plain backprojection of the same samples, time", seconds["folded_over_plain"], TIME_RATIO)
    )
    pictures = {"images": images, "truth": truth, "motion": found.motion}
    return Reproduction(name="zhou2022-table2", parameters=parameters, rows=rows, required=required, pictures=pictures)


def grid() -> ImageGrid:
    """Return the chips of all three points, one below the other, as one grid."""
    return ImageGrid.from_points(np.concatenate([geometry.stacked(x) for x in geometry.GROUND_RANGES]))


def regions() -> list[ImageGrid]:
    """Return the chips at 50 and 60 km, not quite centred on their points."""
    reach = 0.5 * REGION_STEP * (REGION_SHAPE[0] - 1)
    out = []
    for ground_range, (across, along) in zip(geometry.GROUND_RANGES[:2], REGION_OFF, strict=True):
        origin = (ground_range + across - reach, along - reach, 0.0)
        out.append(ImageGrid.plane(origin, (0.0, REGION_STEP, 0.0), (REGION_STEP, 0.0, 0.0), REGION_SHAPE))
    return out


def compensated(method: str, echo: hrws.Echo, threads: int) -> tuple[ComplexArray, hrws.SiMecResult | None]:
    """Form the image by a method of the table."""
    if method == NONE:
        return hrws.reconstruct(echo, grid(), threads=threads, **BAND), None
    if method == SI_MEC:
        found = hrws.si_mec(echo, grid(), regions(), threads=threads, **BAND)
        return found.image, found
    chip = geometry.chip(geometry.GROUND_RANGES[0], 0.0, PHASE_REGION)
    if method == PGA:
        return hrws.pga(echo, grid(), chip, do_no_harm=False, threads=threads, **BAND).image, None
    return hrws.bp_fmsa(echo, grid(), chip, threads=threads, **BAND).image, None


def parts(image: ComplexArray) -> list[ComplexArray]:
    """Return what belongs to each point."""
    return np.split(image, len(geometry.GROUND_RANGES))


def aperture(n_pulse: int = geometry.N_PULSE) -> float:
    """Return the length of so many pulses, m."""
    return n_pulse * geometry.VELOCITY / geometry.PRF


def table_rows(method: str, image: ComplexArray) -> Rows:
    """Return a row for each point, the paper's figures beside ours."""
    rows = []
    for n, (ground_range, part) in enumerate(zip(geometry.GROUND_RANGES, parts(image), strict=True)):
        row = {"method": method, "case": CASES[n]} | geometry.figures(part, ground_range, aperture())
        paper = PAPER.get(method)
        rows.append(row | {"paper_pslr_db": paper[n][0] if paper else None, "paper_islr_db": paper[n][1] if paper else None})
    return rows


def other_draw(seed: int, threads: int, step: Callable[[], None]) -> Rows:
    """Return the rows of another height error."""
    echo = geometry.simulated(geometry.GROUND_RANGES, geometry.height_error(seed), threads)
    rows = table_rows(f"{SI_MEC}, seed {seed}", compensated(SI_MEC, echo, threads)[0])
    step()
    return rows


def cross_track_draw(seed: int, threads: int) -> tuple[Rows, hrws.SiMecResult]:
    """Return the rows of an error of the same size in height and across the track, both unknown."""
    motion = geometry.height_error(seed)
    motion[:, 0] = np.random.default_rng([seed, 1]).uniform(-0.5, 0.5, len(motion)) * geometry.WAVELENGTH
    echo = geometry.simulated(geometry.GROUND_RANGES, motion, threads)
    found = hrws.si_mec(echo, grid(), regions(), "cross_track", threads=threads, **BAND)
    return table_rows(f"{SI_MEC}, height and cross-track", found.image), found


def fixed_beam(truth_seed: int, threads: int) -> Rows:
    """Return the rows of a beam that sees every point over the same Doppler bandwidth: 55 pulses that see the farthest see no other."""
    truth = geometry.height_error(truth_seed, BEAM_PULSES)
    seen = {"doppler_bandwidth": geometry.DOPPLER_BANDWIDTH}
    echo = geometry.simulated(geometry.GROUND_RANGES[:2], truth, threads, **seen)
    motion = hrws.si_mec(echo, geometry.chip(geometry.GROUND_RANGES[0], 0.0, (8, 8)), regions(), threads=threads, **BAND).motion
    rows = []
    for case, ground_range in zip(CASES, geometry.GROUND_RANGES, strict=True):
        own = geometry.simulated((ground_range,), truth, threads, **seen)
        image = hrws.reconstruct(own, ImageGrid.from_points(geometry.stacked(ground_range)), motion, threads=threads, **BAND)
        slant_range = float(np.hypot(ground_range, geometry.HEIGHT))
        length = 0.5 * geometry.WAVELENGTH * slant_range * geometry.DOPPLER_BANDWIDTH / geometry.VELOCITY
        rows.append({"method": f"{SI_MEC}, fixed beam", "case": case} | geometry.figures(image, ground_range, length))
    return rows


def reconstructions(threads: int) -> dict[str, float]:
    """Return how far the folded reconstruction is from the literal one, dB of its energy; no motion, pulses before and behind."""
    out = {}
    for case, ground_range in zip(CASES, geometry.GROUND_RANGES, strict=True):
        still = np.zeros((BEAM_PULSES, 3))
        echo = geometry.simulated((ground_range,), still, threads, doppler_bandwidth=geometry.DOPPLER_BANDWIDTH)
        chip = geometry.chip(ground_range, 0.0, geometry.SHAPE)
        folded = hrws.reconstruct(echo, chip, threads=threads, **BAND)
        literal = hrws.reconstruct(echo, chip, reconstruction="sub_image", threads=threads, **BAND)
        out[case] = float(10.0 * np.log10(np.sum(np.abs(folded - literal) ** 2) / np.sum(np.abs(literal) ** 2)))
    return out


def times(truth: FloatArray, threads: int) -> dict[str, float]:
    """Time one image by plain backprojection, by the folded and the literal reconstruction; the first two take turns."""
    echo = geometry.simulated(geometry.GROUND_RANGES[:1], truth, threads)
    chip = geometry.chip(geometry.GROUND_RANGES[0], 0.0, TIME_SHAPE)
    plain, folded = [], []
    for _ in range(ROUNDS):
        plain.append(seconds(lambda: geometry.plain(echo, chip, truth, threads)))
        folded.append(seconds(lambda: hrws.reconstruct(echo, chip, truth, threads=threads, **BAND)))
    literal = seconds(lambda: hrws.reconstruct(echo, chip, truth, reconstruction="sub_image", threads=threads, **BAND))
    ratio = float(np.median(np.array(folded) / np.array(plain)))
    return {
        "plain": min(plain),
        "folded": min(folded),
        "literal": literal,
        "folded_over_plain": ratio,
        "literal_over_plain": literal / min(plain),
    }


def seconds(job: Callable[[], object]) -> float:
    """Return the time of one call."""
    started = time.perf_counter()
    job()
    return time.perf_counter() - started


def motion_rms(motion: FloatArray, truth: FloatArray) -> float:
    """Return the RMS error of the height, constant and line removed, wavelengths."""
    pulse = np.arange(len(truth))
    left = (motion - truth)[:, 2]
    left = left - np.polynomial.Polynomial.fit(pulse, left, 1)(pulse)
    return float(np.sqrt(np.mean(left**2)) / geometry.WAVELENGTH)


def told(found: hrws.SiMecResult) -> dict[str, Any]:
    """Return what the result says of itself."""
    return {
        "status": found.status.name,
        "coherence": found.coherence,
        "coherence_by_chance": found.coherence_by_chance,
        "held_out": [None if np.isnan(x) else float(x) for x in found.regions["held_out"]],
        "spread": None if np.isnan(found.spread) else found.spread,
        "seconds": dict(found.timings),
    }


def described(seed: int) -> dict[str, Any]:
    """Return the parameters of the experiment."""
    return {
        "wavelength": geometry.WAVELENGTH,
        "bandwidth": geometry.BANDWIDTH,
        "range_sampling": geometry.RANGE_SAMPLING,
        "prf": geometry.PRF,
        "doppler_bandwidth": geometry.DOPPLER_BANDWIDTH,
        "height": geometry.HEIGHT,
        "velocity": geometry.VELOCITY,
        "channels": geometry.CHANNELS.tolist(),
        "n_pulse": geometry.N_PULSE,
        "seed": seed,
        "other_seeds": [seed + 1 + n for n in range(DRAWS)],
        "cross_track_seed": seed + DRAWS + 1,
        "islr_extent": "10 side lobes each side: -10.11 dB of a sinc; the paper doesn't say how many",
    }


def bounds(rows: Rows) -> list[Requirement]:
    """Return the bounds on SI-MEC: of the table point by point, of the other draws at worst."""
    free = {row["case"]: row for row in rows if row["method"] == FREE}

    def off(row: dict[str, Any], name: str) -> float:
        return abs(float(row[name]) - float(free[row["case"]][name]))

    out = []
    for row in (row for row in rows if row["method"] == SI_MEC):
        what = f"{SI_MEC}, {row['case']}: "
        out.append(at_most(what + "PSLR off the error-free, dB", off(row, "pslr_db"), TOLERANCE_DB))
        out.append(at_most(what + "ISLR off the error-free, dB", off(row, "islr_db"), TOLERANCE_DB))
        out.append(at_most(what + "highest azimuth ambiguity, dB", row["ambiguity_db"], AMBIGUITY_DB))
    others = [row for row in rows if row["method"].startswith(f"{SI_MEC}, seed")]
    both = [row for row in rows if row["method"].endswith("cross-track")]
    for what, some in ((f"{DRAWS} other draws", others), ("height and cross-track together", both)):
        out.append(at_most(f"{SI_MEC}, {what}: PSLR off the error-free, dB", max(off(row, "pslr_db") for row in some), TOLERANCE_DB))
        out.append(at_most(f"{SI_MEC}, {what}: ISLR off the error-free, dB", max(off(row, "islr_db") for row in some), TOLERANCE_DB))
        out.append(at_most(f"{SI_MEC}, {what}: highest azimuth ambiguity, dB", max(row["ambiguity_db"] for row in some), AMBIGUITY_DB))
    return out


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw the three points by every method, their cuts along azimuth and the motion; return the files written."""
    from ..report.figures import save  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.hrws_figures import points_figure  # noqa: PLC0415

    held = result.pictures
    images = {
        method: dict(zip(CASES, (part[: geometry.SHAPE[0]] for part in parts(image)), strict=True))
        for method, image in held["images"].items()
    }
    path = folder / "zhou2022_table2.png"
    save(points_figure(images, geometry.STEP, held["truth"][:, 2] * 1e3, held["motion"][:, 2] * 1e3), path)
    return [path]
