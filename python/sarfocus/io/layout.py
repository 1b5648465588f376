"""The package's own layout, the same in ``.npz`` and HDF5: named arrays.

=====================  ==========================  =====================================================================
name                   type                        meaning
=====================  ==========================  =====================================================================
format                 text                        ``sarfocus``
version                integer                     1; a reader refuses a higher one
kind                   text                        ``phase_history`` or ``image``
metadata               text                        a JSON object
data                   complex64 [.., ..]          [pulse, range] or [azimuth, range]
positions              float64 [n_pulse, 3]        m (monostatic), or transmitter and receiver apart:
transmitter, receiver  float64 [n_pulse, 3]        m
range_start            float64 [] or [n_pulse]     m (phase history)
range_spacing          float64                     m
wavelength             float64                     m (phase history)
track/pulse_time       float64 [n_pulse]           s, on the radar's clock (phase history whose motion has a clock of its own)
track/time             float64 [n]                 s, on the track's clock
track/position         float64 [n, 3]              m
track/offset           float64                     s, radar's clock to track's
track/minimum_step     float64                     m from pulse to pulse up to which the platform rests
azimuth_spacing        float64                     m (image, optional)
grid/kind              text                        ``plane``, ``polar`` or ``points`` (image, optional)
grid/vectors           float64 [3, 3]              plane: origin, azimuth step, range step; polar: centre, range and azimuth direction
grid/axes              float64 [4]                 polar: range start, range spacing, angle start, angle spacing
grid/points            float64 [.., .., 3]         points
geometry/<field>       float64                     the fields of StripmapGeometry (image, optional)
arrays/<name>          any                         further arrays that belong to an image
=====================  ==========================  =====================================================================

In HDF5 the names before a slash are groups, complex numbers are compound (r, i), and ``data`` is stored in chunks of whole rows, about
1 MiB each, so that a reader can stream it by pulses.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core.geometry import ImageGrid, StripmapGeometry
from ..plain import plain
from .errors import FormatError
from .model import Image, PhaseHistory, Track

VERSION = 1
Fields = dict[str, npt.NDArray[Any]]
TRACK_FIELDS = ("pulse_time", "time", "position", "offset", "minimum_step")
GEOMETRY_FIELDS = ("wavelength", "prf", "velocity", "slant_range", "doppler_bandwidth", "doppler_centroid")


def to_fields(item: PhaseHistory | Image) -> Fields:
    """Turn a phase history or an image into named arrays."""
    kind = "phase_history" if isinstance(item, PhaseHistory) else "image"
    fields: Fields = {
        "format": np.array("sarfocus"),
        "version": np.array(VERSION),
        "kind": np.array(kind),
        "metadata": np.array(json.dumps(plain(item.metadata), allow_nan=False)),
        "data": item.data,
    }
    return fields | (_history_fields(item) if isinstance(item, PhaseHistory) else _image_fields(item))


def _history_fields(history: PhaseHistory) -> Fields:
    fields = {name: np.asarray(getattr(history, name), dtype=np.float64) for name in ("range_start", "range_spacing", "wavelength")}
    if isinstance(history.positions, tuple):
        fields["transmitter"], fields["receiver"] = history.positions
    elif history.positions is not None:
        fields["positions"] = history.positions
    if history.track is not None:
        fields |= {f"track/{name}": np.asarray(getattr(history.track, name), dtype=np.float64) for name in TRACK_FIELDS}
    return fields


def _image_fields(image: Image) -> Fields:
    fields: Fields = {}
    for name in ("azimuth_spacing", "range_spacing"):
        if getattr(image, name) is not None:
            fields[name] = np.asarray(getattr(image, name), dtype=np.float64)
    if image.grid is not None:
        fields |= {f"grid/{name}": values for name, values in _grid_fields(image.grid).items()}
    if image.geometry is not None:
        fields |= {f"geometry/{name}": np.asarray(getattr(image.geometry, name)) for name in GEOMETRY_FIELDS}
    return fields | {f"arrays/{name}": values for name, values in image.arrays.items()}


def _grid_fields(grid: ImageGrid) -> Fields:
    if grid.kind == "points":
        return {"kind": np.array("points"), "points": grid.positions()}
    fields = {"kind": np.array(grid.kind), "vectors": np.asarray(grid.vectors)}
    return fields | ({"axes": np.asarray(grid.polar_axes)} if grid.kind == "polar" else {})


def from_fields(fields: Mapping[str, Any]) -> PhaseHistory | Image:
    """Rebuild the object from named arrays; whatever does not fit is a FormatError."""
    if "format" not in fields or _text(fields, "format") != "sarfocus":
        raise FormatError("not a sarfocus file: the field «format» does not say so")
    version = int(_field(fields, "version"))
    if version > VERSION:
        raise FormatError(f"layout version {version} is newer than this package reads ({VERSION})")
    kind = _text(fields, "kind")
    try:
        metadata = json.loads(_text(fields, "metadata"))
    except json.JSONDecodeError as error:
        raise FormatError(f"metadata: expected a JSON object, got {error}") from error
    if kind == "phase_history":
        return _history(fields, metadata)
    if kind == "image":
        return _image(fields, metadata)
    raise FormatError(f"kind: expected phase_history or image, got {kind}")


def _history(fields: Mapping[str, Any], metadata: dict[str, Any]) -> PhaseHistory:
    positions: Any = None
    if "positions" in fields:
        positions = fields["positions"]
    elif "transmitter" in fields:
        positions = (fields["transmitter"], _field(fields, "receiver"))
    start, spacing, wavelength = (_field(fields, name) for name in ("range_start", "range_spacing", "wavelength"))
    track = None
    if "track/time" in fields:
        pulse_time, time, position, offset, minimum_step = (_field(fields, f"track/{name}") for name in TRACK_FIELDS)
        track = Track(pulse_time, time, position, float(offset), float(minimum_step))
    return PhaseHistory(_field(fields, "data"), positions, start, float(spacing), float(wavelength), metadata, track)


def _image(fields: Mapping[str, Any], metadata: dict[str, Any]) -> Image:
    data = _field(fields, "data")
    spacings = {name: float(fields[name]) for name in ("azimuth_spacing", "range_spacing") if name in fields}
    arrays = {name.removeprefix("arrays/"): values for name, values in fields.items() if name.startswith("arrays/")}
    geometry = None
    if "geometry/prf" in fields:
        values: dict[str, Any] = {name: _field(fields, f"geometry/{name}") for name in GEOMETRY_FIELDS}
        geometry = StripmapGeometry(**{name: value if value.ndim else float(value) for name, value in values.items()})
    return Image(data, grid=_grid(fields, data), geometry=geometry, metadata=metadata, arrays=arrays, **spacings)


def _grid(fields: Mapping[str, Any], data: npt.NDArray[Any]) -> ImageGrid | None:
    if "grid/kind" not in fields:
        return None
    kind = _text(fields, "grid/kind")
    if kind == "points":
        return ImageGrid.from_points(_field(fields, "grid/points"))
    vectors = _field(fields, "grid/vectors")
    if vectors.shape != (3, 3):
        raise FormatError(f"grid/vectors: expected shape (3, 3), got {vectors.shape}")
    if kind == "plane":
        return ImageGrid.plane(vectors[0], vectors[1], vectors[2], data.shape)
    if kind == "polar":
        names = ("range_start", "range_spacing", "angle_start", "angle_spacing")
        axes = dict(zip(names, (float(v) for v in _field(fields, "grid/axes")), strict=True))
        return ImageGrid.polar(vectors[0], vectors[1], vectors[2], **axes, shape=data.shape)
    raise FormatError(f"grid/kind: expected plane, polar or points, got {kind}")


def _field(fields: Mapping[str, Any], name: str) -> npt.NDArray[Any]:
    if name not in fields:
        raise FormatError(f"the field «{name}» is missing")
    return np.asarray(fields[name])


def _text(fields: Mapping[str, Any], name: str) -> str:
    return str(_field(fields, name)[()])
