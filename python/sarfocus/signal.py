"""Chirps, windows and interpolation."""

from ._core.signal import chirp, upsample, window

__all__ = ["chirp", "upsample", "window"]
