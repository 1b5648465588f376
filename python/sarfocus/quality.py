"""Measures of focus: entropy, contrast, point response."""

from ._core.quality import contrast, entropy, entropy_log10, psnr, sharpness

__all__ = ["contrast", "entropy", "entropy_log10", "psnr", "sharpness"]
