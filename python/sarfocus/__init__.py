"""sarfocus: brings defocused synthetic aperture radar data into focus."""

from . import detect, io, quality, signal, simulate
from ._core import Cancelled, MemoryEstimateError, NumericalError, ShapeError, __version__
from ._core.autofocus import PhaseEstimate, Result, Status, estimate_phase, gpga, pga
from ._core.focus import (
    RangeCompressed,
    azimuth_compress,
    azimuth_decompress,
    backproject,
    backproject_histories,
    compress_frequency,
    project,
    range_compress,
)
from ._core.geometry import ImageGrid, StripmapGeometry

__all__ = [
    "Cancelled",
    "ImageGrid",
    "MemoryEstimateError",
    "NumericalError",
    "PhaseEstimate",
    "RangeCompressed",
    "Result",
    "ShapeError",
    "Status",
    "StripmapGeometry",
    "__version__",
    "azimuth_compress",
    "azimuth_decompress",
    "backproject",
    "backproject_histories",
    "compress_frequency",
    "detect",
    "estimate_phase",
    "gpga",
    "io",
    "pga",
    "project",
    "quality",
    "range_compress",
    "signal",
    "simulate",
]
