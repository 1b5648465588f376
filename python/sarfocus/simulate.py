"""Simulated echoes: the forward model, independent of the image formation."""

from ._core.sim import motion_error, points, points_frequency, stripmap, stripmap_echo

__all__ = ["motion_error", "points", "points_frequency", "stripmap", "stripmap_echo"]
