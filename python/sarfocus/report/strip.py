"""What a page says of a strip besides: the strip as a whole, displaced targets, seams."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import measurement
from ..experiments.strips import slope_of_shift
from ..io import Image
from . import strip_figures
from .figures import LABELS, data_uri
from .model import Comparison, Section

SEARCH = {"before": 16, "after": 4, "ideal": 2}  # pixels round where a target is expected
States = Mapping[str, npt.NDArray[np.complex64]]
FloatArray = npt.NDArray[np.float64]


def is_strip(image: Image) -> bool:
    """Whether the image is a strip with known spacings."""
    return image.geometry is not None and image.azimuth_spacing is not None and image.range_spacing is not None


def gauge_shift(image: Image, range_gate: int) -> float:
    """Return by how many pixels of azimuth the line that data don't tell moves a point of the corrected strip; 0 with no known truth."""
    truth, estimate = image.arrays.get("true_phase_error"), image.arrays.get("phase_error")
    if image.geometry is None or truth is None or estimate is None:
        return 0.0
    slope = float(np.polyfit(np.arange(len(truth)), truth - estimate, 1)[0])
    return slope / slope_of_shift(image.geometry, 1.0, range_gate)


def spread(known: npt.NDArray[Any], count: int) -> list[tuple[float, float]]:
    """Return up to `count` of the known targets, spread evenly over the strip."""
    order = known[np.argsort(known[:, 0])]
    chosen = np.linspace(0, len(order) - 1, min(count, len(order)) + 2)[1:-1].round().astype(int)
    return [(float(u), float(g)) for u, g in order[chosen]]


def image_sections(image: Image, states: States, places: Sequence[tuple[float, float]]) -> list[Section]:
    """Return the strip as a whole, and the surroundings of the points."""
    shown = {LABELS[state]: data for state, data in states.items()}
    spacing = (image.azimuth_spacing or 1.0, image.range_spacing or 1.0)
    whole = Section(
        title="The strip",
        picture=data_uri(strip_figures.strip_figure(shown, spacing, places)),
        description="Magnitude of the strip " + ", ".join(shown),
        caption="Magnitude in dB, on one scale, averaged along azimuth for the picture. The circles mark the points measured below.",
    )
    if not places:
        return [whole]
    crops = Section(
        title="Its points",
        picture=data_uri(strip_figures.crops_figure(shown, places)),
        description="Surroundings of the marked points " + ", ".join(shown),
        caption="Azimuth from left to right, range upwards, pixels, about the marked places, whose azimuth and range gate stand at the "
        "left. Autofocus may move the whole strip: see below.",
    )
    return [whole, crops]


def displacements(image: Image, states: States) -> dict[str, FloatArray]:
    """Return the displacement of every known target along azimuth, m, by state; after: less what the gauge makes."""
    known = image.arrays.get("target_pixels")
    if known is None or not is_strip(image) or "before" not in states:
        return {}
    step = float(image.azimuth_spacing or 1.0)
    out: dict[str, FloatArray] = {}
    for state in ("before", "after"):
        expected = [(float(u) + (gauge_shift(image, round(g)) if state == "after" else 0.0), float(g)) for u, g in known]
        inside = [(min(max(u, 0.0), image.data.shape[0] - 1.0), g) for u, g in expected]
        found = [measurement.response(image, at, states[state], SEARCH[state]).azimuth.position for at in inside]
        out[state] = step * (np.array(found) - np.array([u for u, _ in expected]))
    return out


def displacement_section(image: Image, moved: Mapping[str, FloatArray]) -> list[Section]:
    """Return the page's part about where the targets lie."""
    if not moved:
        return []
    azimuth = float(image.azimuth_spacing or 1.0) * np.asarray(image.arrays["target_pixels"])[:, 0]
    picture = strip_figures.displacement_figure(azimuth, moved["before"], moved["after"])
    text = (
        f"Linear parts of the phase error displace targets along azimuth. Of {len(azimuth)} targets the brightest pixel lies up to "
        f"{np.abs(moved['before']).max():.2f} m from the true place before, up to {np.abs(moved['after']).max():.2f} m after "
        f"(RMS {rms(moved['before']):.2f} and {rms(moved['after']):.3f} m)."
    )
    caption = "After: less the displacement that one line of phase over the whole strip makes, which no data tell."
    title, description = "Where the targets lie", "Displacement of targets before and after autofocus"
    return [Section(title=title, text=[text], picture=data_uri(picture), description=description, caption=caption)]


def displacement_headline(moved: Mapping[str, FloatArray]) -> list[Comparison]:
    """Return the headline figure of the displacements."""
    if not moved:
        return []
    return [Comparison(name="Displacement of targets (m), RMS", before=f"{rms(moved['before']):.2f}", after=f"{rms(moved['after']):.3f}")]


def rms(values: FloatArray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def seam_section(image: Image) -> list[Section]:
    """Return the page's part about the seams between apertures, where the diagnostics hold them."""
    details = image.metadata.get("autofocus", {}).get("diagnostics", {}).get("strip")
    points = image.arrays.get("points")
    if not details or image.geometry is None or points is None or not details["seams"]["first"]:
        return []
    gates = [round(float(gate)) for gate in points["range"]]
    reach = np.array([0.5 * image.geometry.aperture_samples(gate) for gate in gates])
    pixels = np.array([1.0 / slope_of_shift(image.geometry, 1.0, gate) for gate in gates])
    picture = strip_figures.seams_figure(details["seams"], np.asarray(points["azimuth"] - points["shift"]), reach, pixels)
    used = int(np.count_nonzero(np.asarray(details["seams"]["weight"])))
    segments = int(details["segments"])
    whole = (
        "all of the strip hangs together" if segments == 1 else f"the strip falls into {segments} segments, each with a gauge of its own"
    )
    text = f"{len(gates)} apertures, {len(details['seams']['first'])} overlaps compared, {used} of them used for stitching; {whole}."
    caption = "What the joint stitching leaves of the linear phase between two apertures, as a displacement; large dots weigh more."
    return [
        Section(
            title="Seams", text=[text], picture=data_uri(picture), description="Apertures and residuals of their seams", caption=caption
        )
    ]
