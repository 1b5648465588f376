"""What the files hold: a phase history or an image."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import NumericalError, ShapeError
from .._core.geometry import ImageGrid, StripmapGeometry

ComplexArray = npt.NDArray[np.complex64]
FloatArray = npt.NDArray[np.float64]
Positions = FloatArray | tuple[FloatArray, FloatArray] | None


def require_finite(values: npt.NDArray[Any], name: str) -> None:
    """Raise NumericalError naming the first sample that is NaN or infinite."""
    finite = np.isfinite(values)
    if finite.all():
        return
    where = tuple(int(i) for i in np.unravel_index(int(np.argmin(finite)), values.shape))
    raise NumericalError(f"{name}: expected finite samples, got {values[where]} at {list(where)}")


def require_complex(values: object, name: str, dimensions: int = 2) -> None:
    """Raise unless `values` is a complex64 array with `dimensions` dimensions, none of them of size zero, and finite."""
    if not isinstance(values, np.ndarray):
        raise TypeError(f"{name}: expected a NumPy array of dtype complex64, got {type(values).__name__}")
    if values.dtype != np.complex64:
        raise TypeError(f"{name}: expected dtype complex64, got {values.dtype}")
    if values.ndim != dimensions:
        raise ShapeError(f"{name}: expected {dimensions} dimensions, got shape {values.shape}")
    if values.size == 0:
        raise ShapeError(f"{name}: expected no dimension of size zero, got {values.shape}")
    require_finite(values, name)


def require_positive(value: float, name: str) -> None:
    """Raise ValueError unless `value` is finite and above zero."""
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{name}: expected a finite value > 0, got {value}")


def checked_positions(values: object, name: str, n_pulse: int) -> FloatArray:
    """Antenna positions as float64 [n_pulse, 3]."""
    out = np.asarray(values)
    if out.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected real numbers, got dtype {out.dtype}")
    if out.shape != (n_pulse, 3):
        raise ShapeError(f"{name}: expected shape ({n_pulse}, 3), one position for every pulse, got {out.shape}")
    require_finite(out, name)
    return out.astype(np.float64)


@dataclass
class Track:
    """The motion of the platform as recorded by a clock other than the radar's.

    Attributes
    ----------
    pulse_time : float64 [n_pulse]
        s, on the radar's clock.
    time : float64 [n]
        s, increasing, on the clock of the track.
    position : float64 [n, 3]
        m.
    offset : float
        s, added to the radar's clock to get the track's; the positions of the phase history are those at this offset.
    minimum_step : float
        m from pulse to pulse at or below which the platform rests; see `sarfocus.path_weights`.

    Raises
    ------
    ShapeError, ValueError, NumericalError
    """

    pulse_time: FloatArray
    time: FloatArray
    position: FloatArray
    offset: float = 0.0
    minimum_step: float = 0.0

    def __post_init__(self) -> None:
        for name in ("pulse_time", "time"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.ndim != 1:
                raise ShapeError(f"track.{name}: expected one dimension, got shape {values.shape}")
            require_finite(values, f"track.{name}")
            setattr(self, name, values)
        self.position = checked_positions(self.position, "track.position", self.time.size)
        if not (np.diff(self.time) > 0).all():
            raise ValueError("track.time: expected increasing values")
        self.offset, self.minimum_step = float(self.offset), float(self.minimum_step)
        if not (np.isfinite(self.offset) and self.minimum_step >= 0):
            raise ValueError(f"track: expected a finite offset and a minimum_step >= 0, got {self.offset} and {self.minimum_step}")


@dataclass
class PhaseHistory:
    """Range-compressed echoes with the carrier phase kept, and where the radar was.

    Attributes
    ----------
    data : complex64 [n_pulse, n_range]
        A scatterer at range R contributes ``exp(-4j * pi * R / wavelength)`` times the pulse response.
    positions : float64 [n_pulse, 3], or a pair (transmitter, receiver) of them, or None
        m; None where no trajectory was recorded.
    range_start : float or float64 [n_pulse]
        m, range of sample 0.
    range_spacing : float
        m between samples.
    wavelength : float
        m.
    metadata : dict
        Plain data. Keys that are used here: ``scene_centre`` (x, y, z in m), ``scene_size`` (azimuth, range in m), ``bandwidth`` (Hz),
        ``source``.
    track : Track, optional
        Where the positions come from, if from a clock of its own. `sarfocus.motion` works with it.

    Raises
    ------
    TypeError, ShapeError, ValueError, NumericalError
        A field of the wrong type, shapes that disagree, values that are not positive or not finite.
    """

    data: ComplexArray
    positions: Positions
    range_start: float | FloatArray
    range_spacing: float
    wavelength: float
    metadata: dict[str, Any] = field(default_factory=dict)
    track: Track | None = None

    def __post_init__(self) -> None:
        require_complex(self.data, "data")
        n_pulse = self.data.shape[0]
        if isinstance(self.positions, tuple):
            if len(self.positions) != 2:
                raise ShapeError(f"positions: expected a pair (transmitter, receiver), got {len(self.positions)} arrays")
            self.positions = (
                checked_positions(self.positions[0], "transmitter positions", n_pulse),
                checked_positions(self.positions[1], "receiver positions", n_pulse),
            )
        elif self.positions is not None:
            self.positions = checked_positions(self.positions, "positions", n_pulse)
        if self.track is not None and (len(self.track.pulse_time) != n_pulse or not isinstance(self.positions, np.ndarray)):
            raise ShapeError(
                f"track: expected one time and one position for each of {n_pulse} pulses, got {len(self.track.pulse_time)} times"
            )
        self.range_start = self._checked_range_start(n_pulse)
        require_positive(self.range_spacing, "range_spacing")
        require_positive(self.wavelength, "wavelength")
        self.range_spacing, self.wavelength = float(self.range_spacing), float(self.wavelength)

    def _checked_range_start(self, n_pulse: int) -> float | FloatArray:
        start = np.asarray(self.range_start, dtype=np.float64)
        if start.shape not in ((), (n_pulse,)):
            raise ShapeError(f"range_start: expected one value or shape ({n_pulse},), got {start.shape}")
        require_finite(np.atleast_1d(start), "range_start")
        return float(start) if start.ndim == 0 else start

    @property
    def antenna(self) -> FloatArray | tuple[FloatArray, FloatArray]:
        """The positions, where there are any; ValueError where no trajectory was recorded."""
        if self.positions is None:
            raise ValueError("positions: this phase history has no recorded trajectory")
        return self.positions

    @property
    def phase_centres(self) -> FloatArray:
        """Midpoint of transmitter and receiver of every pulse, float64 [n_pulse, 3], m."""
        antenna = self.antenna
        return 0.5 * (antenna[0] + antenna[1]) if isinstance(antenna, tuple) else antenna


@dataclass
class Image:
    """A complex image and where its pixels lie.

    Attributes
    ----------
    data : complex64 [n_azimuth, n_range]
    grid : ImageGrid or None
        Pixel positions, where the image was formed by backprojection.
    geometry : StripmapGeometry or None
        The collection, where the image is a stripmap.
    azimuth_spacing, range_spacing : float or None
        m between pixels; taken from a plane grid where not given.
    metadata : dict
        Plain data.
    arrays : dict of arrays
        What belongs to the image: after autofocus ``before``, ``phase_error``, ``phase_std``, ``points``.
    """

    data: ComplexArray
    grid: ImageGrid | None = None
    geometry: StripmapGeometry | None = None
    azimuth_spacing: float | None = None
    range_spacing: float | None = None
    metadata: dict[str, Any] = field(default_factory=dict)
    arrays: dict[str, npt.NDArray[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_complex(self.data, "image")
        if self.grid is not None and tuple(self.grid.shape) != self.data.shape:
            raise ShapeError(f"grid: expected the shape of the image {self.data.shape}, got {tuple(self.grid.shape)}")
        if self.geometry is not None and len(self.geometry.slant_range) != self.data.shape[1]:
            gates, got = self.data.shape[1], len(self.geometry.slant_range)
            raise ShapeError(f"geometry.slant_range: expected one value for each of {gates} range gates, got {got}")
        if self.grid is not None and self.grid.kind == "plane":
            vectors = np.asarray(self.grid.vectors)
            self.azimuth_spacing = self.azimuth_spacing or float(np.linalg.norm(vectors[1]))
            self.range_spacing = self.range_spacing or float(np.linalg.norm(vectors[2]))
        for name in ("azimuth_spacing", "range_spacing"):
            if getattr(self, name) is not None:
                require_positive(getattr(self, name), name)
