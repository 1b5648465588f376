"""AFRL Gotcha volumetric SAR: one degree of azimuth in a MATLAB 5 file, struct `data`."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.io

from .._core import ShapeError
from .._core.focus import compress_frequency
from .errors import FormatError, reading
from .model import FloatArray, PhaseHistory, require_complex

NEEDED = ("fp", "freq", "x", "y", "z", "r0")
SCENE_SIZE = (100.0, 100.0)  # m, azimuth and range: the useful scene round the origin


def read_gotcha(paths: Sequence[str | PathLike[str]]) -> PhaseHistory:
    """Read one or several files, joined in the order given as one aperture, and compress them in range.

    Parameters
    ----------
    paths : sequence of paths
        ``.mat``.

    Returns
    -------
    PhaseHistory
        One range profile a pulse; range measured from the antenna, so that ``range_start`` differs from pulse to pulse.

    Raises
    ------
    FormatError
        A file that is missing or damaged, fields that do not fit together, files of different frequencies.
    """
    files = [Path(p) for p in paths]
    parts = []
    for file in files:
        with reading(file):
            parts.append(_load(file))
    first = parts[0]["freq"]
    for file, part in zip(files, parts, strict=True):
        if part["freq"].shape != first.shape or not np.allclose(part["freq"], first, rtol=1e-7, atol=0.0):
            raise FormatError(f"{file}: the frequencies differ from those of {files[0]}: the files can't be joined as one aperture")
    joined = {name: np.concatenate([part[name] for part in parts]) for name in ("fp", "positions", "r0")}
    with reading(files[0]):
        return _history(joined, first, [file.name for file in files])


def _load(path: Path) -> dict[str, npt.NDArray[Any]]:
    if not path.exists():
        raise FormatError("no such file")
    content = scipy.io.loadmat(path, squeeze_me=True, variable_names=["data"])
    if "data" not in content or content["data"].dtype.names is None:
        raise FormatError("expected a struct «data», got none")
    struct = content["data"]
    missing = [name for name in NEEDED if name not in struct.dtype.names]
    if missing:
        raise FormatError(f"data: the fields {', '.join(missing)} are missing")
    values = {name: np.atleast_1d(struct[name].item()) for name in NEEDED}
    history = np.ascontiguousarray(values["fp"].T)
    require_complex(history, "data.fp")
    n_pulse, n_frequency = history.shape
    for name, expected in (("freq", n_frequency), ("x", n_pulse), ("y", n_pulse), ("z", n_pulse), ("r0", n_pulse)):
        if values[name].shape != (expected,):
            raise ShapeError(f"data.{name}: expected {expected} values, as data.fp {history.shape[::-1]} has it, got {values[name].shape}")
    positions = np.stack([values[name].astype(np.float64) for name in "xyz"], axis=1)
    return {"fp": history, "freq": values["freq"].astype(np.float64), "positions": positions, "r0": values["r0"].astype(np.float64)}


def reference_range(positions: FloatArray, r0: FloatArray) -> FloatArray:
    """Return the range to which every pulse was compensated: the distance of the antenna from the scene centre, m.

    The files hold positions and that distance, r0, in single precision: at 10 km steps of 0.5 and 1 mm, 0.13 rad RMS of phase at X band
    when taken apart. With the distance computed from the positions as they are given, the two roundings cancel at the scene centre. Where
    r0 differs by more than rounding it means something else, and counts as it is.
    """
    distance = np.linalg.norm(positions, axis=1)
    rounding = np.finfo(np.float32).eps * distance
    return distance if bool(np.all(np.abs(distance - r0) <= 2.0 * rounding)) else r0


def _history(joined: dict[str, npt.NDArray[Any]], frequency: npt.NDArray[np.float64], sources: list[str]) -> PhaseHistory:
    spacing = (frequency[-1] - frequency[0]) / (frequency.size - 1)
    compressed = compress_frequency(
        joined["fp"],
        frequency_start=frequency[0],
        frequency_spacing=spacing,
        reference_range=reference_range(joined["positions"], joined["r0"]),
    )
    metadata = {
        "source": sources,
        "scene_centre": [0.0, 0.0, 0.0],
        "scene_size": list(SCENE_SIZE),
        "bandwidth": spacing * frequency.size,
    }
    return PhaseHistory(
        compressed.data, joined["positions"], compressed.range_start, compressed.range_spacing, compressed.wavelength, metadata
    )
