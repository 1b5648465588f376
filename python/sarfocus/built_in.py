"""The built-in scenes by name."""

from __future__ import annotations

from collections.abc import Callable

from .scenes import Scene, spotlight
from .strip_scene import Strip, strip

SCENES: dict[str, Callable[..., Scene | Strip]] = {"strip": strip, "spotlight": spotlight}
