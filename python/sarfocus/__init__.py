"""sarfocus: brings defocused synthetic aperture radar data into focus."""

from . import quality
from ._core import Cancelled, MemoryEstimateError, NumericalError, ShapeError, __version__
from ._core.autofocus import PhaseEstimate, estimate_phase
from ._core.focus import backproject, backproject_histories, project
from ._core.geometry import ImageGrid, StripmapGeometry

__all__ = [
    "Cancelled",
    "ImageGrid",
    "MemoryEstimateError",
    "NumericalError",
    "PhaseEstimate",
    "ShapeError",
    "StripmapGeometry",
    "__version__",
    "backproject",
    "backproject_histories",
    "estimate_phase",
    "project",
    "quality",
]
