"""Measures of focus: entropy, contrast, point response."""

from ._core.quality import (
    AxisResponse,
    PointResponse,
    contrast,
    entropy,
    entropy_log10,
    point_response,
    psnr,
    sharpness,
)

__all__ = ["AxisResponse", "PointResponse", "contrast", "entropy", "entropy_log10", "point_response", "psnr", "sharpness"]
