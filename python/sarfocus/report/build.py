"""From a result (an image after autofocus, as `sarfocus.io` stores it) to the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import measurement
from ..experiments.crlb import without_line
from ..io import Image
from ..quality import PointResponse
from . import figures, strip
from .decisions import decision_sections
from .model import Comparison, Report, Section, Table
from .page import versions

SHOWN_POINTS = 3
SEARCH = 6  # pixels: autofocus may shift the scene by its gauge
CUT_CELLS = 10.0
STATUS_TEXT = {
    "converged": "Autofocus converged.",
    "not_improved": "Autofocus found nothing to improve; the image is the input, bit for bit.",
    "gaps": "Autofocus converged where apertures reach; parts of the strip have no strong point.",
    "no_strong_points": "Autofocus found no strong points to work on; the image is the input, bit for bit.",
}


def build(image: Image, *, title: str, lead: str, what_was_done: Sequence[str] = (), parameters: dict[str, str] | None = None) -> Report:
    """Build the page of a result; parts whose data the result doesn't hold are left out."""
    states = image_states(image)
    places = image_places(image)
    responses = [{state: _response(image, at, state, data) for state, data in states.items()} for at in places]
    moved = strip.displacements(image, states)
    autofocus = image.metadata.get("autofocus", {})
    sections = [
        *([Section(title="What was done", text=list(what_was_done))] if what_was_done else []),
        *(strip.image_sections(image, states, places) if strip.is_strip(image) else [_images(image, states, places)]),
        *_phase(image),
        *strip.displacement_section(image, moved),
        *strip.seam_section(image),
        *_responses(image, responses),
        *decision_sections(image),
        *_summary(autofocus),
    ]
    whole = {state: measurement.whole_image(data) for state, data in states.items()}
    return Report(
        title=title,
        lead=lead,
        verdict=_verdict(autofocus, whole, responses),
        headline=[*_headline(image, whole, responses), *strip.displacement_headline(moved)],
        sections=[*sections, _table(image, whole, responses)],
        parameters=parameters or {},
        timings={name: f"{seconds:.2f} s" for name, seconds in autofocus.get("seconds", {}).items()},
        versions=versions(),
    )


def image_states(image: Image) -> dict[str, npt.NDArray[np.complex64]]:
    """Return the images the result holds, by state: before, after, ideal."""
    states = {"before": image.arrays.get("before"), "after": image.data, "ideal": image.arrays.get("ideal")}
    return {state: data for state, data in states.items() if data is not None}


def image_places(image: Image) -> list[tuple[float, float]]:
    """Return the pixels to look at: known targets, or the strongest points."""
    known = image.arrays.get("target_pixels")
    if known is not None and strip.is_strip(image):
        return strip.spread(known, SHOWN_POINTS)
    if known is not None:
        return [(float(i), float(j)) for i, j in known[:SHOWN_POINTS]]
    return [(float(i), float(j)) for i, j in measurement.strong_points(image.data, SHOWN_POINTS)]


def _response(image: Image, at: tuple[float, float], state: str, data: npt.NDArray[np.complex64]) -> PointResponse:
    """Measure a point where the state of the image leads one to expect it."""
    if not strip.is_strip(image):
        return measurement.response(image, at, data, SEARCH)
    shift = strip.gauge_shift(image, round(at[1])) if state == "after" else 0.0
    return measurement.response(image, (at[0] + shift, at[1]), data, strip.SEARCH[state])


def _images(image: Image, states: dict[str, npt.NDArray[np.complex64]], places: Sequence[tuple[float, float]]) -> Section:
    shown = {figures.LABELS[state]: states[state] for state in ("before", "after") if state in states}
    spacing = None
    if image.azimuth_spacing and image.range_spacing:
        spacing = (image.azimuth_spacing, image.range_spacing)
    return Section(
        title="The image",
        picture=figures.data_uri(figures.image_figure(shown, spacing, places)),
        description="Magnitude of the image " + " and ".join(shown),
        caption="Magnitude in dB, on one scale for all panels. The circles mark the points that are measured below.",
    )


def _phase(image: Image) -> list[Section]:
    estimate = image.arrays.get("phase_error")
    if estimate is None or not np.isfinite(estimate).any():
        return []
    truth = image.arrays.get("true_phase_error")
    shown = np.nan_to_num(estimate)
    text = "The phase error is known up to a constant and a line, which only move the scene; both are removed here."
    if truth is not None:
        truth = without_line(truth)
        rmse = np.sqrt(np.mean((without_line(shown) - truth) ** 2))
        text += f" Against the true error {rmse:.3f} rad RMS are left of {np.sqrt(np.mean(truth**2)):.2f} rad."
    picture = figures.phase_figure(without_line(shown), image.arrays.get("phase_std"), truth, _slow_time(image))
    caption = "The band is one standard deviation, as the estimator states it."
    return [
        Section(
            title="Phase error", text=[text], picture=figures.data_uri(picture), description="Phase error over slow time", caption=caption
        )
    ]


def _slow_time(image: Image) -> str:
    method = image.metadata.get("autofocus", {}).get("method")
    return {"gpga": "pulse", "spga": "azimuth sample (slow time)", "spga_linear": "azimuth sample (slow time)"}.get(
        method, "azimuth spectrum, bin"
    )


def _responses(image: Image, responses: Sequence[dict[str, PointResponse]]) -> list[Section]:
    if not responses:
        return []
    step = image.azimuth_spacing or 1.0
    unit = "m" if image.azimuth_spacing else "pixels"
    cuts = []
    for number, found in enumerate(responses, start=1):
        reach = CUT_CELLS * min(one.azimuth.irw for one in found.values())
        top = max(one.amplitude for one in found.values())
        cuts.append((f"point {number}", {state: _cut(one, step, reach, top) for state, one in found.items()}))
    caption = "Azimuth cuts, interpolated 32 times, each centred on its own peak; levels over the brightest peak of the same point."
    return [
        Section(
            title="Point responses",
            picture=figures.data_uri(figures.cuts_figure(cuts, unit)),
            description="Azimuth cuts through the marked points",
            caption=caption,
        )
    ]


def _cut(found: PointResponse, step: float, reach: float, top: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    level = found.azimuth.cut * (found.amplitude / top)
    position = found.azimuth.cut_position - found.azimuth.position
    near = np.abs(position) <= reach
    return position[near] * step, 20.0 * np.log10(np.maximum(level[near], 1e-6))


def _table(image: Image, whole: dict[str, dict[str, float]], responses: Sequence[dict[str, PointResponse]]) -> Section:
    unit, step = ("m", image.azimuth_spacing) if image.azimuth_spacing else ("pixels", 1.0)
    head = ["", "state", f"IRW azimuth ({unit})", "PSLR (dB)", "ISLR (dB)", "peak (dB)", "verdict"]
    rows = []
    for number, found in enumerate(responses, start=1):
        top = max(one.amplitude for one in found.values())
        for state, one in found.items():
            line = one.azimuth
            level = round(20.0 * float(np.log10(one.amplitude / top)), 2)
            cells = [f"{line.irw * (step or 1.0):.3f}", f"{line.pslr_db:.2f}", f"{line.islr_db:.2f}", f"{level + 0.0:.2f}"]
            rows.append([f"point {number}", figures.LABELS[state], *cells, measurement.verdict_text(one)])
    for state, values in whole.items():
        entropy, contrast = f"{values['entropy']:.3f}", f"{values['contrast']:.2f}"
        rows.append(["whole image", figures.LABELS[state], "", "", "", "", f"entropy {entropy}, contrast {contrast}"])
    theory = next(iter(responses[0].values())).azimuth if responses else None
    caption = "Peak: over the brightest state of the same point."
    if theory is not None:
        caption += (
            f" An unweighted response has PSLR {theory.theory_pslr_db:.2f} dB and ISLR {theory.theory_islr_db:.2f} dB over the same extent."
        )
    return Section(title="Figures", table=Table(caption=caption, head=head, rows=rows))


def _headline(image: Image, whole: dict[str, dict[str, float]], responses: Sequence[dict[str, PointResponse]]) -> list[Comparison]:
    if "before" not in whole:
        return []
    measures = [
        ("Entropy (nats)", {state: values["entropy"] for state, values in whole.items()}, ".3f"),
        ("Contrast", {state: values["contrast"] for state, values in whole.items()}, ".2f"),
    ]
    if responses:
        step, unit = (image.azimuth_spacing, "m") if image.azimuth_spacing else (1.0, "pixels")
        widths = {state: step * float(np.median([found[state].azimuth.irw for found in responses])) for state in whole}
        lobes = {state: float(np.median([found[state].azimuth.pslr_db for found in responses])) for state in whole}
        measures += [(f"Azimuth IRW ({unit}), median", widths, ".3f"), ("Azimuth PSLR (dB), median", lobes, ".2f")]
    return [_comparison(name, values, spec) for name, values, spec in measures]


def _comparison(name: str, values: dict[str, float], spec: str) -> Comparison:
    note = f"error-free {values['ideal']:{spec}}" if "ideal" in values else ""
    return Comparison(name=name, before=f"{values['before']:{spec}}", after=f"{values['after']:{spec}}", note=note)


def _verdict(autofocus: dict[str, Any], whole: dict[str, dict[str, float]], responses: Sequence[dict[str, PointResponse]]) -> str:
    status = str(autofocus.get("status"))
    clocks = autofocus.get("time_offset", {})
    moved = clocks.get("offset", 0.0) - clocks.get("recorded", 0.0)
    if moved != 0.0:
        after = {"not_improved": "found nothing more to improve", "no_strong_points": "found no strong points to work on"}.get(
            status, f"ended: {status}"
        )
        parts = [f"The clocks of radar and track were brought together by {1e3 * moved:+.1f} ms; autofocus then {after}."]
    else:
        parts = [STATUS_TEXT.get(status, f"Status: {status}." if autofocus else "No autofocus was run.")]
    if {"before", "after", "ideal"} <= whole.keys():
        lost = whole["before"]["entropy"] - whole["ideal"]["entropy"]
        if lost > 0:
            gained = (whole["before"]["entropy"] - whole["after"]["entropy"]) / lost
            beyond = " (more than all: the estimate fits a little of the speckle too)" if gained > 1.0 else ""
            parts.append(f"{100 * gained:.1f} % of the entropy that the error cost was recovered{beyond}.")
    good = sum(measurement.verdict_text(found["after"]) == "good" for found in responses)
    if responses:
        parts.append(f"{good} of {len(responses)} measured points respond as theory says.")
    return " ".join(parts)


def _summary(autofocus: dict[str, Any]) -> list[Section]:
    text = autofocus.get("summary")
    return [Section(title="What autofocus reports", text=[line for line in text.splitlines() if line.strip()])] if text else []
