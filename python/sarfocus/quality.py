"""Measures of focus: entropy, contrast, point response, azimuth ambiguities."""

from ._core.quality import (
    AxisResponse,
    PointResponse,
    azimuth_ambiguity_offset,
    azimuth_ambiguity_ratio,
    contrast,
    entropy,
    entropy_log10,
    point_response,
    psnr,
    sharpness,
)

__all__ = [
    "AxisResponse",
    "PointResponse",
    "azimuth_ambiguity_offset",
    "azimuth_ambiguity_ratio",
    "contrast",
    "entropy",
    "entropy_log10",
    "point_response",
    "psnr",
    "sharpness",
]
