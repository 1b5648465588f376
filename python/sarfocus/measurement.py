"""Figures of an image: over the whole of it, and of its strong points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from . import detect, quality
from .io import Image
from .io.model import ComplexArray

SEPARATION = 24  # pixels between strong points that are told apart
MARGIN = 16  # pixels from the border
PROMINENCE_DB = 20.0  # above the image's mean power, of a point worth measuring
UPSAMPLE = 32  # points of a cut per pixel
AXES = ("azimuth", "range")


def whole_image(data: ComplexArray, threads: int = 0) -> dict[str, float]:
    """Return entropy (nats and decimal), contrast and sharpness."""
    names = ("entropy", "entropy_log10", "contrast", "sharpness")
    return {name: float(getattr(quality, name)(data, threads=threads)) for name in names}


def strong_points(data: ComplexArray, count: int) -> list[tuple[int, int]]:
    """Return up to `count` pixels (azimuth, range), strongest first: local maxima apart from one another and from the border."""
    inside = np.zeros(data.shape, dtype=np.bool_)
    inside[MARGIN:-MARGIN, MARGIN:-MARGIN] = True
    floor = 10.0 ** (PROMINENCE_DB / 10.0) * float(np.vdot(data, data).real) / data.size
    found = detect.local_maxima(data, mask=inside, half_width=(SEPARATION, SEPARATION), minimum=floor, count=count)
    return [(int(point["azimuth"]), int(point["range"])) for point in found]


def oversampling(image: Image) -> tuple[float, float] | None:
    """Return the pixels per resolution cell (azimuth, range); None where the image doesn't say."""
    cells = image.metadata.get("resolution")
    spacings = (image.azimuth_spacing, image.range_spacing)
    if cells is None or None in spacings:
        return None
    ratios = [cell / spacing for cell, spacing in zip(cells, spacings, strict=True) if spacing]
    return (ratios[0], ratios[1]) if min(ratios) >= 1.0 else None


def response(image: Image, at: Sequence[float], data: ComplexArray | None = None, search: int = 2) -> quality.PointResponse:
    """Return the point response of `image` (or of `data` on the same grid) near the pixel `at`."""
    return quality.point_response(
        image.data if data is None else data, (at[0], at[1]), search=search, upsample=UPSAMPLE, oversampling=oversampling(image)
    )


def response_figures(found: quality.PointResponse) -> dict[str, Any]:
    """Return the figures of a point response, without the cuts."""
    out: dict[str, Any] = {"azimuth": found.azimuth.position, "range": found.range.position, "amplitude": found.amplitude}
    for axis in AXES:
        line = getattr(found, axis)
        out |= {f"irw_{axis}": line.irw, f"pslr_{axis}_db": line.pslr_db, f"islr_{axis}_db": line.islr_db}
    return out | {"verdict": verdict_text(found)}


def verdict_text(found: quality.PointResponse) -> str:
    """Return the verdict on a point response as words."""
    return found.verdict.replace("_", " ")
