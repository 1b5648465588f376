"""The studies that chose the parameters of adaptive PGA: tables 2 to 6 and figures 8 to 12 [Luo2025], on scenes of clutter statistics.

Nothing is judged here: every result counts as it was estimated, whether or not it does harm. Scores as in table 7.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import Result, adaptive, adaptive_pga, conventional_pga, detect
from . import luo2025
from . import luo2025_scenes as scenes
from .luo2025_scenes import ComplexArray, Draw, FloatArray
from .model import Reproduction, Requirement, at_least, at_most

SEED = 20250119
SHAPE = (512, 1024)  # a sub-aperture of the paper [Luo2025, section 2.2.4]
ERROR = "order 4"
MU = (3.0, 3.5, 4.0, 4.5, 5.0)
REFERENCE, GUARD = 8, 3  # cells each side: 16 reference cells as in the paper; its number of guard cells is not given
PER_GATE, COALESCE = 5, (4, 4)
KS = (256, 128, 64, 32, 16, 8, 4, 2, 1)
ETAS = (1.0, 1.5, 2.0, 2.5, 2.6, 2.7, 2.8, 2.9, 3.0, 3.5)
PASSES, FAILS = 1.0, 1e6  # mu, of amplitudes: every scene exceeds the one, none the other
LENGTH_KS = (32, 8, 1)
LENGTHS = (512, 256, 128, 64, 32)  # azimuth lines of a sub-aperture
UPSAMPLE, MAIN_LOBE, SIDE_LOBES = (
    16,
    1.3,
    32.0,
)  # of the cut through a point; pixels: a little beyond the first null, and as far as side lobes count
WEAK = {"near plain speckle": scenes.Statistics(20.0, 12.0, 0.0, (0.0, 0.0)), "texture": scenes.Statistics(1.0, 12.0, 0.0, (0.0, 0.0))}
PAPER_2 = {scenes.NONE: (77, 53, 21, 10, 0), scenes.FEW: (14, 13, 7, 6, 3)}
PAPER_3 = (("no", (6.8934, 6.7794), (34.7402, 23.8824)), ("yes", (6.8335, 6.7398), (46.2472, 35.5369)))
PAPER_4 = {
    256: (36.0886, 14.9567), 128: (36.3103, 14.6616), 64: (36.4182, 14.4488), 32: (35.9476, 14.4270), 16: (35.1307, 15.4781),
    8: (34.8610, 20.5172), 4: (31.1696, 27.3800), 1: (29.8399, 25.4620),
}  # fmt: skip
PAPER_5 = {
    scenes.NONE: ((6.8435, 6.8335, 6.8252, 6.8052, 6.8057, 6.8000, 6.7834, 6.7834, 6.7835, 6.7834),
                  (34.7402, 35.6704, 36.3983, 39.5139, 38.6341, 40.0472, 46.2472, 46.3294, 46.9140, 46.8418)),
    scenes.FEW: ((4.2725, 4.2725, 4.2725, 4.2725, 4.2725, 4.3433, 4.3671, 4.3771, 4.3803, 4.3896),
                 (36.6998, 37.0112, 37.0048, 36.6954, 35.7781, 28.7848, 26.1729, 25.8121, 25.3012, 25.8174)),
}  # fmt: skip
PAPER_6 = {
    128: (2.1602, 0.8431, 2.5622, 4.5835, 30.2646), 64: (2.2374, 0.8634, 2.5912, 4.5435, 42.8572),
    32: (2.3285, 0.8848, 2.6316, 4.5269, 46.0871), 16: (2.4348, 0.9042, 2.6927, 4.5260, 46.5681),
    8: (2.6128, 0.9385, 2.7840, 4.5260, 47.8321), 4: (2.8592, 0.9388, 3.0359, 4.5272, 45.8612),
    2: (3.1109, 0.9403, 3.3087, 4.5528, 30.9500), 1: (3.4123, 0.9484, 3.5980, 4.5616, 32.6863),
}  # fmt: skip
Rows = list[dict[str, Any]]
Progress = Callable[[str, int, int], None] | None


def run(*, seed: int = SEED, shape: tuple[int, int] = SHAPE, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Run the five studies; rows of all, told apart by ``case``."""
    drawn = {scene: made(scene, seed, shape) for scene in scenes.SCENES}
    rows: Rows = []
    studies: tuple[Callable[[], Rows], ...] = (
        lambda: detections(drawn),
        lambda: denoising(seed, shape, threads),
        lambda: responses(drawn, threads),
        lambda: thresholds(drawn, threads),
        lambda: gates(drawn[scenes.FEW], threads),
        lambda: lengths(drawn[scenes.FEW], threads),
    )
    for number, study in enumerate(studies, start=1):
        rows += study()
        if progress is not None:
            progress("luo2025-studies", number, len(studies))
    parameters: dict[str, Any] = {"seed": seed, "error": ERROR, "judged": False, "reference_cells": 2 * REFERENCE, "guard_cells": 2 * GUARD}
    parameters |= {"candidates": f"{PER_GATE} of every range gate, coalesced within {COALESCE}"} | scenes.described(
        shape, (scenes.CLUTTER,)
    )
    parameters["not_required"] = not_required(rows)
    return Reproduction(name="luo2025-studies", parameters=parameters, rows=rows, required=required(rows))


def made(scene: str, seed: int, shape: tuple[int, int]) -> Draw:
    """Return the draw of a scene."""
    return scenes.draw(scene, ERROR, shape, amplitude=None, generator=np.random.default_rng([seed, scenes.SCENES.index(scene)]))


def detections(drawn: dict[str, Draw]) -> Rows:
    """Count what azimuth CFAR detects over mu, comparing amplitudes as the paper does, and intensities as its mu is meant [table 2]."""
    rows: Rows = []
    for scene in (scenes.NONE, scenes.FEW):
        ratios = over_clutter(drawn[scene].image)
        for number, mu in enumerate(MU):
            row: dict[str, Any] = {"case": "table 2: detections", "method": scene, "mu": mu}
            row["false_alarm_rate"] = false_alarm_probability(mu)
            row |= {f"detections_{name}": int(np.sum(ratio > mu)) for name, ratio in ratios.items()}
            rows.append(row | {"candidates": len(ratios["amplitude"]), "paper": PAPER_2[scene][number]})
    return rows


def over_clutter(image: ComplexArray) -> dict[str, FloatArray]:
    """Return amplitude and intensity of the candidates over the mean of their reference cells, of the same quantity."""
    points = detect.coalesce(detect.strongest_samples(image, PER_GATE), COALESCE)
    offsets = np.arange(GUARD + 1, GUARD + REFERENCE + 1)
    azimuth = np.asarray(points["azimuth"])[:, None] + np.concatenate([-offsets[::-1], offsets])
    reached = (azimuth >= 0) & (azimuth < len(image))
    amplitude = np.abs(image[np.clip(azimuth, 0, len(image) - 1), np.asarray(points["range"])[:, None]])
    own = np.sqrt(np.asarray(points["intensity"]))
    out = {}
    for name, power in (("amplitude", 1), ("intensity", 2)):
        out[name] = own**power / np.average(amplitude.astype(np.float64) ** power, axis=1, weights=reached)
    return out


def false_alarm_probability(mu: float) -> float:
    """Return the probability that belongs to mu = N (P^(-1/N) - 1) [Luo2025, section 2.2.1]: of exponential intensities."""
    cells = 2 * REFERENCE
    return float((1.0 + mu / cells) ** -cells)


def denoising(seed: int, shape: tuple[int, int], threads: int) -> Rows:
    """Score PGA of scenes without strong points with and without the mean filter [table 3]; beside it what the gate says of them."""
    rows: Rows = []
    for number, (name, statistics) in enumerate(WEAK.items()):
        draw = scenes.draw(statistics, ERROR, shape, amplitude=None, generator=np.random.default_rng([seed, 3, number]))
        results = {
            "no": conventional_pga(draw.image, k=luo2025.K, do_no_harm=False, threads=threads),
            "yes": adaptive_pga(draw.image, mu=FAILS, do_no_harm=False, threads=threads),
        }
        judged = score(draw, adaptive_pga(draw.image, mu=FAILS, threads=threads), threads)["entropy"]
        passes, _ = adaptive.cfar_gate(draw.image, threads=threads)
        before = luo2025.score(luo2025.INPUT, draw, threads).row["entropy"]
        for filtered, entropy, psnr in PAPER_3:
            row = {"case": "table 3: mean filter", "method": name, "filtered": filtered, "passes_the_gate": passes, "input_entropy": before}
            row["judged_entropy"] = judged if filtered == "yes" else None
            row |= score(draw, results[filtered], threads)
            rows.append(row | {"paper_entropy_log10": entropy[number], "paper_psnr": psnr[number]})
    return rows


def responses(drawn: dict[str, Draw], threads: int) -> Rows:
    """Measure the azimuth response of the brightest point of a scene over the number of range gates [table 4]."""
    rows: Rows = []
    for scene in (scenes.FEW, scenes.MANY):
        draw = drawn[scene]
        gate = int(np.argmax(np.abs(draw.truth).max(axis=0)))
        place = int(np.argmax(np.abs(draw.truth[:, gate])))
        ideal = response(draw.truth, place, gate)
        for k in KS:
            found = scored(draw, conventional_pga(draw.image, k=k, do_no_harm=False, threads=threads), threads)
            row = {"case": "table 4: point response", "method": scene, "k": k} | response(found.image, place, gate)
            row |= {f"ideal_{name}": value for name, value in ideal.items()}
            peak, secondary = PAPER_4.get(k, (None, None))
            ratio = None if peak is None or secondary is None else peak - secondary
            rows.append(row | {"paper_peak_db": peak, "paper_secondary_db": secondary, "paper_ratio_db": ratio})
    return rows


def response(image: ComplexArray, place: int, gate: int) -> dict[str, float]:
    """Return peak and highest side lobe of a cut along azimuth, dB over the mean of the image; the peak within a few pixels of `place`."""
    n = len(image)
    spectrum = np.fft.fft(image[:, gate])
    padded = np.zeros(UPSAMPLE * n, dtype=complex)
    padded[: n // 2], padded[-(n // 2) :] = spectrum[: n // 2], spectrum[-(n // 2) :]
    power = np.abs(UPSAMPLE * np.fft.ifft(padded)) ** 2 / np.mean(np.abs(image) ** 2)
    azimuth = np.arange(UPSAMPLE * n) / UPSAMPLE
    near = np.flatnonzero(np.abs(azimuth - place) <= SIDE_LOBES / 2)
    peak = near[np.argmax(power[near])]
    away = np.abs(azimuth - azimuth[peak])
    levels = 10.0 * np.log10([power[peak], power[(away > MAIN_LOBE) & (away <= SIDE_LOBES)].max()])
    return {"peak_db": float(levels[0]), "secondary_db": float(levels[1]), "ratio_db": float(levels[0] - levels[1])}


def thresholds(drawn: dict[str, Draw], threads: int) -> Rows:
    """Score adaptive PGA over eta, without and with strong points in the scene [table 5]; both pass the gate, eta alone decides."""
    rows: Rows = []
    for scene in (scenes.NONE, scenes.FEW):
        draw = drawn[scene]
        before = luo2025.score(luo2025.INPUT, draw, threads).row["entropy"]
        for number, eta in enumerate(ETAS):
            result, judged = (adaptive_pga(draw.image, eta=eta, mu=PASSES, do_no_harm=harm, threads=threads) for harm in (False, True))
            used = [part["gates"] for part in result.diagnostics["adaptive"]["sub_apertures"]]
            row = {"case": "table 5: eta", "method": scene, "eta": eta, "gates": [min(used), max(used)], "input_entropy": before}
            row |= score(draw, result, threads) | {"judged_entropy": score(draw, judged, threads)["entropy"], "judged": judged.status.name}
            rows.append(row | {"paper_entropy_log10": PAPER_5[scene][0][number], "paper_psnr": PAPER_5[scene][1][number]})
    return rows


def gates(draw: Draw, threads: int) -> Rows:
    """Compare the mean energies of strong and other gates, and score conventional PGA, over the number of gates [table 6]."""
    energies = adaptive.gate_energies(draw.image, len(draw.image), threads=threads)[0]
    rows: Rows = []
    for k in KS[1:]:
        m1, m2 = means(energies, k)
        row = {"case": "table 6: k", "method": luo2025.UNJUDGED, "k": k, "ratio": m1 / m2}
        row |= {name: float(10.0 * np.log10(mean / energies.mean())) for name, mean in (("m1_db", m1), ("m2_db", m2))}
        row |= score(draw, conventional_pga(draw.image, k=k, do_no_harm=False, threads=threads), threads)
        names = ("paper_m1", "paper_m2", "paper_ratio", "paper_entropy_log10", "paper_psnr")
        rows.append(row | dict(zip(names, PAPER_6[k], strict=True)))
    return rows


def means(energies: FloatArray, k: int) -> tuple[float, float]:
    """Return m1 and m2 of the k strongest gates, whatever their ratio [Luo2025, eq. 12]."""
    _, m1, m2 = adaptive.choose_gates(energies, k, eta=1e-9)
    return m1, m2


def lengths(draw: Draw, threads: int) -> Rows:
    """Compare m1 / m2 over the length of the sub-apertures, mean of all of a length: what one eta takes for granted."""
    rows: Rows = []
    for length in (length for length in LENGTHS if length <= len(draw.image)):
        row: dict[str, Any] = {"case": "m1 / m2 over the sub-aperture", "method": scenes.FEW, "length": length}
        energies = adaptive.gate_energies(draw.image, length, threads=threads)
        for k in LENGTH_KS:
            row[f"ratio_k{k}"] = float(np.mean([m1 / m2 for m1, m2 in (means(energy, k) for energy in energies)]))
        rows.append(row)
    return rows


def scored(draw: Draw, result: Result, threads: int) -> luo2025.Scored:
    """Score a result in the gauge of the truth."""
    return luo2025.scored(draw, result.image, np.asarray(result.phase_error), threads)


def score(draw: Draw, result: Result, threads: int) -> dict[str, float]:
    """Return the figures of a result."""
    row = scored(draw, result, threads).row
    return {name: row[name] for name in ("entropy", "entropy_log10", "psnr", "rmse")}


def required(rows: Rows) -> list[Requirement]:
    """Return what must hold of the paper's statements, and of where this package departs from them."""
    two, three, four, five, six = (of_table(rows, number) for number in range(2, 7))
    out = []
    for scene in (scenes.NONE, scenes.FEW):
        own = [row for row in two if row["method"] == scene]
        shares = [row["detections_amplitude"] / max(1, own[0]["detections_amplitude"]) for row in own]
        out.append(at_most(f"table 2, scene {scene}: detections at mu = 5 over those at mu = 3, amplitudes", shares[-1], 0.1))
    noise = next(row for row in two if row["method"] == scenes.NONE and row["mu"] == MU[-1])
    share = noise["detections_intensity"] / max(1, noise["candidates"])
    out.append(at_least("table 2, no points: share of candidates over mu = 5, were it of intensities", share, 0.2))
    for row in (row for row in three if row["filtered"] == "yes"):
        harm = row["judged_entropy"] - row["input_entropy"]
        out.append(at_most(f"table 3, {row['method']}: entropy with the mean filter, judged, less that of the input, nat", harm, 0.0))
    ratio = {(row["method"], row["k"]): row["ratio_db"] for row in four}
    steady = min(ratio[scenes.MANY, k] for k in KS if k >= 32)
    out.append(at_least("table 4, many points: peak over side lobe, least of k = 32 to 256, dB", steady, 12.0))
    lost = ratio[scenes.MANY, 128] - ratio[scenes.MANY, 1]
    out.append(at_least("table 4, many points: peak over side lobe at k = 128 less that at k = 1, dB", lost, 0.0))
    gained = ratio[scenes.FEW, 4] - ratio[scenes.FEW, 128]
    out.append(at_least("table 4, few points: peak over side lobe at k = 4 less that at k = 128, dB", gained, 3.0))
    few = [row["entropy"] for row in five if row["method"] == scenes.FEW]
    out.append(at_most("table 5, few points: entropy over all eta, largest less least, nat", max(few) - min(few), 0.005))
    worst = max(row["judged_entropy"] - row["input_entropy"] for row in five)
    out.append(at_most("table 5: entropy, judged, less that of the input, any eta, nat", worst, 0.0))
    means_db = np.array([[row["m1_db"], row["m2_db"]] for row in six])
    for column, name in enumerate(("m1", "m2")):
        out.append(at_least(f"table 6: least rise of {name} as k is halved, dB", float(np.diff(means_db[:, column]).min()), 1e-4))
    entropy = {row["k"]: row["entropy"] for row in six}
    out.append(at_least("table 6: entropy at k = 128 less the least, nat", entropy[128] - min(entropy.values()), 0.03))
    out.append(at_least("table 6: entropy at k = 1 less the least, nat", entropy[1] - min(entropy.values()), 0.003))
    return out


def not_required(rows: Rows) -> list[dict[str, Any]]:
    """Return what the paper finds for the mean filter, which these scenes do not bear out: entropy with it no higher than without."""
    out = []
    for name in WEAK:
        found = {row["filtered"]: row for row in of_table(rows, 3) if row["method"] == name}
        gain = found["yes"]["entropy"] - found["no"]["entropy"]
        over_input = found["yes"]["entropy"] - found["yes"]["input_entropy"]
        out.append(
            {"what": f"table 3, {name}: with the filter less without, nat", "value": gain, "holds": gain <= 0.0, "over_input": over_input}
        )
    return out


def of_table(rows: Rows, number: int) -> Rows:
    """Return the rows of a table of the paper."""
    return [row for row in rows if row["case"].startswith(f"table {number}:")]


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw every study; return the files written."""
    from ..report.figures import save  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.scene_figures import study_figure  # noqa: PLC0415

    paths = []
    for name, (case, abscissa, label, panels) in STUDIES.items():
        own = [row for row in result.rows if row["case"] == case and row[abscissa] is not None]
        places = list(dict.fromkeys(row[abscissa] for row in own))
        drawn = [{"title": title, "unit": unit, "lines": lines(own, abscissa, values)} for title, unit, values in panels]
        paths.append(folder / f"luo2025_{name}.png")
        save(study_figure(drawn, label, places, logarithmic=abscissa in ("k", "length")), paths[-1])
    return paths


def lines(rows: Rows, abscissa: str, values: dict[str, str]) -> dict[str, tuple[list[Any], list[Any]]]:
    """Return by label the places and the values of every method; what a row does not have is left out."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    out: dict[str, tuple[list[Any], list[Any]]] = {}
    for text, value in values.items():
        for method in methods:
            own = [(row[abscissa], row[value]) for row in rows if row["method"] == method and row[value] is not None]
            drawn = ([place for place, _ in own], [value for _, value in own])
            if own and drawn not in out.values():  # the paper's one scene stands beside two of ours
                out[" ".join(part for part in (method if len(methods) > 1 and value not in ONE_SCENE else "", text) if part)] = drawn
    return out


ONE_SCENE = ("paper_peak_db", "paper_secondary_db", "paper_ratio_db")
ENTROPY = ("entropy", "nat", {"": "entropy"})
PSNR = ("PSNR against the error-free image", "dB", {"": "psnr"})
PAPER_ENTROPY = ("entropy in the paper", "decimal logarithm", {"(paper)": "paper_entropy_log10"})
PAPER_PSNR = ("PSNR in the paper", "dB", {"(paper)": "paper_psnr"})
# file: case, abscissa, its label, panels of title, unit and values by label
STUDIES: dict[str, tuple[str, str, str, list[tuple[str, str, dict[str, str]]]]] = {
    "table2": (
        "table 2: detections", "mu", "mu",
        [("amplitudes compared", "detections", {"": "detections_amplitude", "(paper)": "paper"}),
         ("intensities compared", "detections", {"": "detections_intensity"})],
    ),
    "table3": ("table 3: mean filter", "filtered", "mean filter", [ENTROPY, PSNR]),
    "table4": (
        "table 4: point response", "k", "k, range gates",
        [("peak", "dB over the mean", {"": "peak_db", "(paper)": "paper_peak_db"}),
         ("highest side lobe", "dB over the mean", {"": "secondary_db", "(paper)": "paper_secondary_db"}),
         ("peak over side lobe", "dB", {"": "ratio_db", "(paper)": "paper_ratio_db"})],
    ),
    "table5": ("table 5: eta", "eta", "eta", [ENTROPY, PAPER_ENTROPY, PSNR, PAPER_PSNR]),
    "table6": (
        "table 6: k", "k", "k, range gates",
        [("mean energies", "dB over the mean of all", {"m1": "m1_db", "m2": "m2_db"}),
         ("m1 / m2", "", {"": "ratio", "(paper)": "paper_ratio"}), ENTROPY, PSNR],
    ),
    "sub_apertures": (
        "m1 / m2 over the sub-aperture", "length", "azimuth lines of a sub-aperture",
        [("strong gates over the others", "m1 / m2", {f"k = {k}": f"ratio_k{k}" for k in LENGTH_KS})],
    ),
}  # fmt: skip
