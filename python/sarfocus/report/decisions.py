"""What a page says of the decisions that autofocus made: which method, which points, and whether to apply what it found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..io import Image
from . import decision_figures
from .figures import data_uri
from .model import Section, Table

SHOWN_CELLS = 8  # those nearest to detection, or farthest beyond it


def decision_sections(image: Image) -> list[Section]:
    """Return the page's parts about the decisions whose diagnostics the result holds."""
    diagnostics = image.metadata.get("autofocus", {}).get("diagnostics", {})
    return [
        *_method(diagnostics.get("trials") or []),
        *_gate(diagnostics.get("adaptive") or {}),
        *_sub_apertures(diagnostics.get("adaptive") or {}),
        *_score(diagnostics.get("score") or {}),
    ]


def _method(trials: Sequence[dict[str, Any]]) -> list[Section]:
    if not trials:
        return []
    chosen = [trial["method"] for trial in trials if trial["chosen"]]
    text = (
        "Every method was tried on one part of the range gates and judged on the strong points of the other part, which had no say in its "
        "phase, and the other way round. " + (f"Chosen: {chosen[0]}." if chosen else "None was chosen: the image is the input.")
    )
    rows = []
    for trial in trials:
        judged = trial["held_out_points"] > 0 and _known(trial["held_out_gain_db"])
        gain = f"{trial['held_out_gain_db']:+.2f} ± {trial['held_out_std_db']:.2f}" if judged else "–"
        entropy = f"{trial['held_out_entropy']:+.4f}" if judged else "–"
        seconds = f"{trial['seconds']:.2f}"
        rows.append([trial["method"], gain, str(trial["held_out_points"]), entropy, seconds, trial["reason"]])
    head = ["method", "gain (dB)", "points", "entropy (nat)", "time (s)", "why"]
    caption = "Gain: mean change of the peaks of held-back strong points and its standard error. Entropy: of their neighbourhoods."
    shown = [trial for trial in trials if trial["held_out_points"] > 0 and _known(trial["held_out_gain_db"])]
    title = "Which method, and why"
    if not shown:
        return [Section(title=title, text=[text], table=Table(caption=caption, head=head, rows=rows, words=True))]
    picture = data_uri(decision_figures.trials_figure(shown))
    return [
        Section(title=title, text=[text], table=Table(caption=caption, head=head, rows=rows, words=True)),
        Section(
            title="Gain of points that were held back",
            picture=picture,
            description="Gain of held-back strong points for every method",
            caption="Mean and three standard errors; the method that was chosen is filled.",
        ),
    ]


def _gate(adaptive: dict[str, Any]) -> list[Section]:
    cells = adaptive.get("cells") or []
    if not cells:
        return []
    found = sum(cell["detected"] for cell in cells)
    verdict = (
        f"{found} of the {len(cells)} strongest cells exceed the threshold of the azimuth CFAR: the scene has strong points."
        if adaptive["strong_points"]
        else f"None of the {len(cells)} strongest cells exceeds the threshold of the azimuth CFAR: the scene has no strong points."
    )
    if adaptive["denoised"] > 0:
        first, count = adaptive["first_denoised"], adaptive["denoised"]
        verdict += f" So the phase was estimated from range gates {first} to {first + count - 1}, mean-filtered over 3 x 3 pixels."
    unit = 20.0 if adaptive.get("amplitudes") else 10.0
    rows = []
    for cell in sorted(cells, key=lambda cell: -float(cell["value"]) / max(float(cell["threshold"]), 1e-300))[:SHOWN_CELLS]:
        over = unit * np.log10(cell["value"] / cell["clutter"]) if cell["clutter"] > 0 and cell["value"] > 0 else np.nan
        need = unit * np.log10(cell["threshold"] / cell["clutter"]) if cell["clutter"] > 0 and cell["threshold"] > 0 else np.nan
        place = f"{cell['azimuth']}, {cell['range']}"
        verdict_of = "strong point" if cell["detected"] else "not detected"
        rows.append([place, str(cell["extent"]), _decibel(over), _decibel(need), verdict_of])
    caption = "The strongest cells of the scene, of several lengths in azimuth, against the mean of their reference cells."
    table = Table(
        caption=caption, head=["azimuth, range", "length", "over clutter (dB)", "threshold (dB)", "verdict"], rows=rows, words=True
    )
    return [Section(title="Are there strong points?", text=[verdict], table=table)]


def _sub_apertures(adaptive: dict[str, Any]) -> list[Section]:
    parts = adaptive.get("sub_apertures") or []
    if not parts:
        return []
    used = [part["gates"] for part in parts if part["gates"] > 0]
    lines = parts[0]["count"]
    text = f"{len(parts)} azimuth sub-apertures of {lines} lines, overlapping by half. " if len(parts) > 1 else f"One of {lines} lines. "
    if used:
        text += (
            f"The number of range gates k was halved until their mean energy exceeded {adaptive['eta']:g} times that of the rest: "
            f"k = {min(used)} to {max(used)}. "
        )
    skipped = len(parts) - len(used)
    text += f"In {skipped} of them even the strongest gate does not stand out; they were skipped." if skipped else "None was skipped."
    title = "Strong range gates of every sub-aperture"
    if len(parts) == 1:
        return [Section(title=title, text=[text])]
    return [
        Section(
            title=title,
            text=[text],
            picture=data_uri(decision_figures.sub_apertures_figure(parts, float(adaptive["eta"]))),
            description="Number of range gates and energy ratio of every sub-aperture",
            caption="Above: range gates used, k. Below: mean energy of these gates over that of the others; the line is what was asked.",
        )
    ]


def _score(score: dict[str, Any]) -> list[Section]:
    if not score or not score.get("reason"):
        return []
    reason = score["reason"]
    text = f"{reason[0].upper()}{reason[1:]}."
    rows = []
    if score["entropy_before"] > 0 or score["entropy_after"] > 0:
        rows.append(["entropy (nat), before and with the phase found", f"{score['entropy_before']:.4f}", f"{score['entropy_after']:.4f}"])
    if _known(score["held_out_gain"]) and score["held_out_noise"] > 0:
        rows.append(["gain of what was held out (nat), and by chance", f"{score['held_out_gain']:+.4f}", f"{score['held_out_noise']:.4f}"])
    rows.append(["gain of the strong points' peaks (dB)", f"{score['point_gain_db']:+.2f}", ""])
    title = "Why the phase was applied" if score["improved"] else "Why the phase was not applied"
    return [Section(title=title, text=[text], table=Table(caption="What the decision rests on.", head=["", "", ""], rows=rows))]


def _known(value: Any) -> bool:
    return value is not None and bool(np.isfinite(value))


def _decibel(value: float) -> str:
    return f"{value:.1f}" if np.isfinite(value) else "–"
