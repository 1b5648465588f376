"""Chirps, windows, interpolation, analytic signals."""

from ._core.signal import analytic_signal, chirp, demodulate, upsample, window

__all__ = ["analytic_signal", "chirp", "demodulate", "upsample", "window"]
