"""sarfocus: brings defocused synthetic aperture radar data into focus."""

from . import detect, io, quality, signal, simulate, strip
from ._core import Cancelled, MemoryEstimateError, NumericalError, ShapeError, __version__
from ._core.autofocus import (
    PhaseEstimate,
    Result,
    Status,
    TimeOffset,
    TimeOffsetStatus,
    estimate_phase,
    estimate_time_offset,
    gpga,
    pga,
)
from ._core.focus import (
    RangeCompressed,
    azimuth_compress,
    azimuth_decompress,
    backproject,
    backproject_histories,
    compress_frequency,
    estimate_doppler_centroid,
    form_stripmap,
    project,
    range_compress,
)
from ._core.geometry import ImageGrid, StripmapGeometry, interpolate_track, path_weights
from ._core.strip import spga, spga_linear

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
    "TimeOffset",
    "TimeOffsetStatus",
    "__version__",
    "azimuth_compress",
    "azimuth_decompress",
    "backproject",
    "backproject_histories",
    "compress_frequency",
    "detect",
    "estimate_doppler_centroid",
    "estimate_phase",
    "estimate_time_offset",
    "form_stripmap",
    "gpga",
    "interpolate_track",
    "io",
    "path_weights",
    "pga",
    "project",
    "quality",
    "range_compress",
    "signal",
    "simulate",
    "spga",
    "spga_linear",
    "strip",
]
