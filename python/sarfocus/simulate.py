"""Simulated echoes: the forward model, independent of the image formation."""

from ._core.sim import points, points_frequency

__all__ = ["points", "points_frequency"]
