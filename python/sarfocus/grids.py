"""Which pixels to form when nobody says: a ground plane round the scene centre; and a check on grids."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import ImageGrid
from .io import PhaseHistory

SPEED_OF_LIGHT = 299792458.0  # m/s
PIXELS_PER_CELL = 2.0
MAX_AXIS = 2**31


def default_grid(
    history: PhaseHistory,
    *,
    centre: Sequence[float] | None = None,
    size: Sequence[float] | None = None,
    spacing: Sequence[float] | None = None,
) -> ImageGrid:
    """Horizontal plane through the scene centre, azimuth axis along the track, range axis away from the radar.

    Parameters
    ----------
    history : PhaseHistory
    centre : (x, y, z), optional
        m; by default ``metadata["scene_centre"]``.
    size : (azimuth, range), optional
        m; by default ``metadata["scene_size"]``, else what the pulses and the range samples cover without ambiguity.
    spacing : (azimuth, range), optional
        m between pixels; by default half a resolution cell.

    Raises
    ------
    ValueError
        No trajectory, no centre, or sizes that are not positive.
    """
    track = history.phase_centres
    middle = _centre(history, centre)
    azimuth, ground_range = axes(track, middle)
    cells = resolution(history, middle)
    steps = _pair(spacing, "spacing") if spacing is not None else cells / PIXELS_PER_CELL
    extent = _pair(size, "size") if size is not None else _default_size(history, middle)
    ratio = np.maximum(1.0, np.round(extent / steps))
    if ratio.max() >= MAX_AXIS:
        raise ValueError(f"size, spacing: expected fewer than 2**31 pixels along an axis, got {ratio[0]:.3g} x {ratio[1]:.3g}")
    shape = (int(ratio[0]), int(ratio[1]))
    steps_m = (steps[0] * azimuth, steps[1] * ground_range)
    origin = middle - 0.5 * (shape[0] - 1) * steps_m[0] - 0.5 * (shape[1] - 1) * steps_m[1]
    return ImageGrid.plane(origin, steps_m[0], steps_m[1], shape)


def axes(track: npt.NDArray[np.float64], centre: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Horizontal unit vectors of azimuth (the sense of flight) and of range (away from the radar), at right angles."""
    away = (centre - track.mean(axis=0)) * (1.0, 1.0, 0.0)
    along = (track[-1] - track[0]) * (1.0, 1.0, 0.0)
    if np.linalg.norm(away) > 0.0:
        away = away / np.linalg.norm(away)
        azimuth = np.array([-away[1], away[0], 0.0])
        return (azimuth if azimuth @ along >= 0.0 else -azimuth), away
    if np.linalg.norm(along) == 0.0:
        raise ValueError("positions: expected a track of some length or a centre that is not straight below it")
    azimuth = along / np.linalg.norm(along)
    return azimuth, np.array([azimuth[1], -azimuth[0], 0.0])


def resolution(history: PhaseHistory, centre: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Resolution (azimuth, ground range) at `centre`, m: wavelength over twice the angle swept, and the range cell seen from above."""
    track = history.phase_centres
    azimuth, _ = axes(track, centre)
    sight = centre - track
    bearing = (sight @ azimuth) / np.linalg.norm(sight, axis=1)
    swept = float(np.ptp(np.arcsin(np.clip(bearing, -1.0, 1.0))))
    bandwidth = history.metadata.get("bandwidth")
    slant = SPEED_OF_LIGHT / (2.0 * bandwidth) if bandwidth else history.range_spacing
    if swept == 0.0:
        raise ValueError("positions: expected a track that moves, got one position for all pulses; give the pixel spacing")
    return np.array([history.wavelength / (2.0 * swept), slant / _ground_factor(track, centre)])


def check_grid(history: PhaseHistory, grid: ImageGrid) -> None:
    """Raise ValueError for a grid that reaches behind the radar, as seen from its track towards the scene centre."""
    track = history.phase_centres
    rows, columns = grid.shape
    corners = np.array([grid.position(i, j) for i in (0, rows - 1) for j in (0, columns - 1)])
    middle = track[len(track) // 2]
    look_at = history.metadata.get("scene_centre")
    if look_at is not None:
        look = (np.asarray(look_at, dtype=np.float64) - middle) * (1.0, 1.0, 0.0)
        depth = (corners - middle) @ look
        if depth.min() <= 0.0:
            worst = corners[int(np.argmin(depth))]
            raise ValueError(
                f"grid: expected all pixels in front of the radar, got the corner {_point(worst)} m behind it (radar at {_point(middle)} m)"
            )


def _point(xyz: npt.NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{v:.2f}" for v in xyz) + ")"


def _centre(history: PhaseHistory, centre: Sequence[float] | None) -> npt.NDArray[np.float64]:
    chosen: Any = centre if centre is not None else history.metadata.get("scene_centre")
    if chosen is None:
        raise ValueError("centre: the file does not say where the scene is; give the scene centre (x, y, z) in m")
    out = np.asarray(chosen, dtype=np.float64)
    if out.shape != (3,) or not np.isfinite(out).all():
        raise ValueError(f"centre: expected three finite coordinates in m, got {chosen}")
    return out


def _pair(values: Sequence[float], name: str) -> npt.NDArray[np.float64]:
    out = np.asarray(values, dtype=np.float64)
    if out.shape != (2,) or not (np.isfinite(out).all() and (out > 0).all()):
        raise ValueError(f"{name}: expected two values > 0 in m (azimuth, range), got {list(values)}")
    return out


def _ground_factor(track: npt.NDArray[np.float64], centre: npt.NDArray[np.float64]) -> float:
    sight = centre - track.mean(axis=0)
    return max(float(np.hypot(sight[0], sight[1]) / np.linalg.norm(sight)), 1e-3)


def _default_size(history: PhaseHistory, centre: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    known = history.metadata.get("scene_size")
    if known is not None:
        return _pair(known, "metadata.scene_size")
    track = history.phase_centres
    azimuth, _ = axes(track, centre)
    sight = centre - track
    distance = np.linalg.norm(sight, axis=1)
    step = float(np.max(np.abs(np.diff((sight @ azimuth) / distance)))) if len(track) > 1 else 0.0
    swath = (history.data.shape[1] - 1) * history.range_spacing / _ground_factor(track, centre)
    unambiguous = history.wavelength * float(distance.mean()) / (2.0 * step) if step > 0 else swath
    return np.array([min(unambiguous, swath), swath])


def grid_axes(grid: ImageGrid) -> dict[str, Any]:
    """Return centre and pixel spacings (m) of a plane grid; nothing for others."""
    if grid.kind != "plane":
        return {}
    rows, columns = grid.shape
    steps = np.linalg.norm(np.asarray(grid.vectors)[1:], axis=1)
    return {"centre": list(grid.position(0.5 * (rows - 1), 0.5 * (columns - 1))), "spacing": [float(step) for step in steps]}
