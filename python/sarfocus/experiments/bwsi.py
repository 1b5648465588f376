"""A trajectory from the echoes alone, on measured data: BWSI recordings on a rail, with motion capture to compare, and carried by hand.

The start is a straight line at constant speed, of a direction and length that are not those of the recording. The motion capture is used
to judge the result, never to find it.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import (
    ImageGrid,
    RidgePath,
    RidgePathStatus,
    Ridges,
    backproject,
    backproject_histories,
    quality,
    track_ridges,
    trajectory_from_ridges,
)
from ..io import PhaseHistory, read_bwsi
from ..io.bwsi import BAND, bwsi_history
from ..io.errors import reading
from ..io.numpy_files import load_npz
from ..motion import moving_pulses, synchronised
from .model import Reproduction, Requirement, at_least, at_most

RAIL, WALK = "rail_team6_trial6.npz", "walk_sculpture_trial3.npz"
RESOLUTION = 299792458.0 / 2.0 / (BAND[1] - BAND[0])  # m, of range
SPEED = {RAIL: 0.5, WALK: 1.0}  # m/s, of the start: a carriage, a person
LINE, CAPTURE, ESTIMATE = "straight line", "motion capture", "estimated"
LINE_FITTED = "line of that length"
# A person sways by decimetres; sculptures hide one another, so that a ridge goes on with another point behind a gap.
WALK_RIDGES: dict[str, Any] = {"pieces": True, "shortest": 0.1}
WALK_FIT: dict[str, Any] = {"across": True, "across_std": 0.3, "range_std": 0.01, "largest_residual": 0.04}
ALONG, LOOK = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])  # of the start, the axes of the capture for the sake of the pictures
SEARCH, CHIP = (1.0, 0.02), (0.4, 0.005)  # m: half size and pixel
WALK_PIXEL, WALK_MARGIN, WALK_DEPTH = 0.03, 3.0, (4.0, 14.0)  # m
BRIGHTEST, APART = 8, 0.6  # scatterers of the walk measured; m
RAIL_PIXEL, RAIL_HALF, RAIL_DEPTH = 0.02, 5.2, (5.5, 10.0)  # m
FloatArray = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex64]
Progress = Callable[[str, int, int], None] | None


@dataclasses.dataclass(frozen=True)
class Scene:
    """Echoes, and positions that go with them."""

    history: PhaseHistory
    positions: FloatArray  # m [n_pulse, 3]
    range_start: float  # m

    @property
    def arguments(self) -> dict[str, Any]:
        """Of `backproject` and others."""
        return {"range_start": self.range_start, "range_spacing": self.history.range_spacing, "wavelength": self.history.wavelength}


def run(*, data: str | os.PathLike[str] | None = None, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Run both recordings.

    Parameters
    ----------
    data : path, optional
        Folder that holds ``bwsi/*.npz``; by default ``$SARFOCUS_DATA``.

    Raises
    ------
    ValueError
        No folder named, no such files, or one of them does not tell a path.
    """
    named = data if data is not None else os.environ.get("SARFOCUS_DATA")
    if named is None:
        raise ValueError("data: expected the folder that holds bwsi/*.npz, by --data or in SARFOCUS_DATA, got none")
    folder = Path(named) / "bwsi"
    made: list[tuple[list[dict[str, Any]], list[Requirement], dict[str, Any]]] = []
    for step, one in enumerate((rail, walk)):
        made.append(one(folder, threads))
        if progress is not None:
            progress("bwsi-trajectory", step + 1, 2)
    rows, required, pictures = zip(*made, strict=True)
    parameters = {
        "resolution": RESOLUTION,
        "start_speed": SPEED,
        "files": [RAIL, WALK],
        "walk_pixel": WALK_PIXEL,
        **{f"walk_{name}": value for name, value in (WALK_RIDGES | WALK_FIT).items()},
    }
    return Reproduction(
        name="bwsi-trajectory",
        parameters=parameters,
        rows=rows[0] + rows[1],
        required=required[0] + required[1],
        pictures={"rail": pictures[0], "walk": pictures[1]},
    )


def echoes(path: Path) -> tuple[PhaseHistory, slice]:
    """Return the phase history of the moving platform without its motion, and which pulses these are.

    Raises
    ------
    ValueError
        Fields are missing.
    ShapeError
        Too few pulses.
    """
    with reading(path):
        fields = load_npz(path)
    missing = [name for name in ("scan_data", "scan_time_s", "range_bins_m") if name not in fields]
    if missing:
        raise ValueError(f"{path.name}: expected the field {missing[0]}, got {', '.join(fields) or 'none'}")
    moving = moving_pulses(fields["scan_data"])
    kept = {name: fields[name][moving] for name in ("scan_data", "scan_time_s")} | {"range_bins_m": fields["range_bins_m"]}
    return bwsi_history(kept, path.name), moving


def straight_start(duration: float, n_pulse: int, speed: float) -> FloatArray:
    """Return a line at constant speed, its middle at the origin, m [n_pulse, 3]."""
    line: FloatArray = np.linspace(-0.5, 0.5, n_pulse)[:, None] * (speed * duration * ALONG)
    return line


def estimate(
    path: Path, threads: int, speed: float | None = None, *, tracking: Mapping[str, Any] | None = None, **options: Any
) -> tuple[Scene, slice, Ridges, RidgePath]:
    """Return the echoes with the straight line at `speed`, which pulses they are, the ridges, and the path found from them.

    Raises
    ------
    ValueError
        Fields are missing, times do not rise, or the ridges do not determine a path.
    """
    history, moving = echoes(path)
    time = load_npz(path)["scan_time_s"][moving]
    if not np.all(np.diff(time) > 0.0):
        raise ValueError(f"{path.name}: scan_time_s: expected times that rise from pulse to pulse")
    start = straight_start(float(time[-1] - time[0]), len(time), SPEED[path.name] if speed is None else speed)
    scene = Scene(history, start, float(history.range_start))
    ridges = track_ridges(history.data, resolution=RESOLUTION, threads=threads, **(tracking or {}), **scene.arguments)
    found = trajectory_from_ridges(ridges.range, start, look=(1.0, 0.0, 0.0), **options)
    if found.status is RidgePathStatus.not_determined:
        raise ValueError(f"{path.name}: no path: {ridges.reason}; {found.reason}")
    return scene, moving, ridges, found


def captured(path: Path, history: PhaseHistory, moving: slice, threads: int) -> tuple[Scene, float, FloatArray]:
    """Return the echoes on the motion capture, the offset between the clocks that makes the image sharpest, and the reflectors."""
    full = read_bwsi(path)
    reflectors = np.asarray(full.metadata["reflectors"])
    low = reflectors.min(axis=0) - (1.7, 1.7, 0.0)
    size = np.ptp(reflectors, axis=0)[:2] + 3.4
    grid = ImageGrid.plane(low, (0.0, 0.03, 0.0), (0.03, 0.0, 0.0), (round(size[1] / 0.03), round(size[0] / 0.03)))
    placed, clocks = synchronised(full, grid, threads=threads)
    return Scene(history, placed.phase_centres[moving], float(full.range_start)), clocks.offset, reflectors


def rail(folder: Path, threads: int) -> tuple[list[dict[str, Any]], list[Requirement], dict[str, Any]]:
    """Run the rail recording: rows, requirements, pictures."""
    path = folder / RAIL
    line, moving, ridges, found = estimate(path, threads)
    on_capture, offset, reflectors = captured(path, line.history, moving, threads)
    on_estimate = dataclasses.replace(line, positions=np.asarray(found.positions))
    still = trajectory_from_ridges(
        ridges.range, line.positions, look=(1.0, 0.0, 0.0), step_change=1e-9, length_std=1e-6, largest_residual=10.0
    )  # only the scatterers move: where the straight line has them
    places = {LINE: by_track(still), CAPTURE: reflectors[np.argsort(reflectors @ ALONG)], ESTIMATE: by_track(found)}
    scenes = {LINE: line, CAPTURE: on_capture, ESTIMATE: on_estimate}
    peaks = {name: [peak_near(scene, place, threads) for place in places[name]] for name, scene in scenes.items()}
    if len(peaks[ESTIMATE]) != len(reflectors):
        raise ValueError(
            f"{path.name}: expected {len(reflectors)} ridges, one for each reflector, got {len(peaks[ESTIMATE])}: {found.reason}"
        )
    rows: list[dict[str, Any]] = []
    for name, scene in scenes.items():
        row: dict[str, Any] = {"recording": "rail", "method": name} | path_difference(scene.positions, on_capture.positions)
        for number, (peak, compared) in enumerate(zip(peaks[name], peaks[CAPTURE], strict=True), start=1):
            values = measure(peak) | {"peak_db": peak.level_db - compared.level_db}
            row |= {f"reflector_{number}_{what}": value for what, value in values.items()}
        rows.append(row)
    rows[-1] |= summary(found) | {"time_offset_of_the_capture": offset}
    pictures = {
        "chips": {name: [(peak.image, peak.beside) for peak in each] for name, each in peaks.items()},
        "scenes": {name: rail_scene(scene, [peak.place for peak in peaks[name]], threads) for name, scene in scenes.items()},
        "difference": difference_along(found, on_capture.positions),
    }
    return rows, rail_required(rows), pictures


def by_track(path: RidgePath) -> FloatArray:
    """Return the places of the scatterers used, in the order of the track."""
    points = path.points
    places: FloatArray = points["position"][points["used"]]
    return places[np.argsort(places @ ALONG)]


def summary(found: RidgePath) -> dict[str, Any]:
    """Return what the estimate says of itself."""
    return {
        "status": found.status.name,
        "reason": found.reason,
        "ridges": int(np.count_nonzero(found.points["used"])),
        "residual_rms": found.residual_rms,
        "coverage": found.coverage,
        "length_ratio": found.length_ratio,
        "length_std": found.length_std,
    }


def across_track(scene: Scene, place: FloatArray) -> FloatArray:
    """Return the unit vector from the track to `place`, at a right angle to the track."""
    towards = place - scene.positions.mean(axis=0)
    look: FloatArray = towards - (towards @ ALONG) * ALONG
    return look / np.linalg.norm(look)


@dataclasses.dataclass(frozen=True)
class Peak:
    """What is brightest near a place."""

    image: Complex  # round it
    at: tuple[int, int]
    place: FloatArray  # m
    beside: tuple[float, float]  # m, of the place expected less the image's middle: across, along
    coherence: float

    @property
    def level_db(self) -> float:
        """Of the peak."""
        return 20.0 * float(np.log10(abs(self.image[self.at])))


def peak_near(scene: Scene, expected: FloatArray, threads: int, within: float = SEARCH[0]) -> Peak:
    """Find the peak near the place expected."""
    look = across_track(scene, expected)
    data = scene.history.data
    place = expected
    for half_size, step in ((within, SEARCH[1]), (min(within, CHIP[0]), CHIP[1])):
        middle = place
        n = 2 * round(half_size / step) + 1
        grid = ImageGrid.plane(middle - 0.5 * (n - 1) * step * (ALONG + look), step * ALONG, step * look, (n, n))
        image = backproject(data, scene.positions, grid, threads=threads, **scene.arguments)
        row, column = (int(at) for at in np.unravel_index(np.argmax(np.abs(image)), image.shape))
        place = np.asarray(grid.position(float(row), float(column)))
    terms = backproject_histories(data, scene.positions, place[None], threads=threads, **scene.arguments)[0]
    coherence = float(abs(terms.sum()) ** 2 / np.abs(terms).sum() ** 2)
    return Peak(image, (row, column), place, (float((expected - middle) @ look), float((expected - middle) @ ALONG)), coherence)


def measure(peak: Peak) -> dict[str, float]:
    """Return the figures of a reflector."""
    response = quality.point_response(peak.image, peak.at, upsample=8)
    return {
        "peak_db": peak.level_db,
        "coherence": peak.coherence,
        "irw_along": CHIP[1] * response.azimuth.irw,
        "irw_across": CHIP[1] * response.range.irw,
        "pslr_along_db": response.azimuth.pslr_db,
    }


def rail_scene(scene: Scene, places: list[FloatArray], threads: int) -> tuple[Complex, list[tuple[float, float]]]:
    """Form the scene in the plane of track and reflectors; and the reflectors' places in it, across and along (m)."""
    middle = scene.positions.mean(axis=0)
    look = across_track(scene, np.mean(places, axis=0))
    shape = (round(2.0 * RAIL_HALF / RAIL_PIXEL), round((RAIL_DEPTH[1] - RAIL_DEPTH[0]) / RAIL_PIXEL))
    corner = middle - RAIL_HALF * ALONG + RAIL_DEPTH[0] * look
    grid = ImageGrid.plane(corner, RAIL_PIXEL * ALONG, RAIL_PIXEL * look, shape)
    image = backproject(scene.history.data, scene.positions, grid, threads=threads, **scene.arguments)
    return image, [(float((place - middle) @ look), float((place - middle) @ ALONG)) for place in places]


def aligned(positions: FloatArray, truth: FloatArray, *, scaled: bool) -> FloatArray:
    """Return the positions turned, mirrored and moved, and stretched where `scaled`, to fit the truth best."""
    here, there = positions - positions.mean(axis=0), truth - truth.mean(axis=0)
    left, singular, right = np.linalg.svd(here.T @ there)
    factor = singular.sum() / np.sum(here**2) if scaled else 1.0
    out: FloatArray = factor * here @ left @ right + truth.mean(axis=0)
    return out


def path_difference(positions: FloatArray, truth: FloatArray) -> dict[str, float]:
    """RMS distance from the truth in space, m, after a rigid motion, and after a change of scale besides."""
    return {
        what: float(np.sqrt(np.mean(np.sum((aligned(positions, truth, scaled=scaled) - truth) ** 2, axis=1))))
        for what, scaled in (("rms_rigid", False), ("rms_scaled", True))
    }


def difference_along(found: RidgePath, truth: FloatArray) -> dict[str, FloatArray]:
    """Return the difference from the truth along the track, m: rigid motion removed, scale besides, and the estimate's own deviation."""
    positions = np.asarray(found.positions)
    out = {
        what: (aligned(positions, truth, scaled=scaled) - truth) @ ALONG
        for what, scaled in (("rigid motion removed", False), ("and scale", True))
    }
    return out | {"deviation": np.linalg.norm(found.motion_std, axis=1)}


def rail_required(rows: list[dict[str, Any]]) -> list[Requirement]:
    """Return the bounds of the rail recording."""
    line, capture, found = rows
    numbers = [number for number in (1, 2) if f"reflector_{number}_peak_db" in found]
    peaks = [found[f"reflector_{number}_peak_db"] for number in numbers]
    gains = [found[f"reflector_{number}_peak_db"] - line[f"reflector_{number}_peak_db"] for number in numbers]
    widths = [found[f"reflector_{number}_irw_along"] / capture[f"reflector_{number}_irw_along"] for number in numbers]
    return [
        at_least("rail: reflectors found", float(found["ridges"]), 2.0),
        at_least("rail: peak of the worse reflector against that on the motion capture, dB", min(peaks), -0.5),
        at_least("rail: gain of the worse reflector over the straight line, dB", min(gains), 6.0),
        at_most("rail: width along the track of the worse reflector over that on the motion capture", max(widths), 1.1),
        at_most("rail: path against the motion capture, rigid motion removed, m RMS", found["rms_rigid"], 0.015),
        at_most("rail: path against the motion capture, scale removed too, m RMS", found["rms_scaled"], 0.008),
    ]


def walk(folder: Path, threads: int) -> tuple[list[dict[str, Any]], list[Requirement], dict[str, Any]]:
    """Run the recording carried by hand: rows, requirements, pictures."""
    line, _, _, found = estimate(folder / WALK, threads, tracking=WALK_RIDGES, **WALK_FIT)
    fitted = dataclasses.replace(line, positions=line.positions * found.length_ratio)
    scenes = {LINE: line, LINE_FITTED: fitted, ESTIMATE: dataclasses.replace(line, positions=np.asarray(found.positions))}
    grid = walk_grid(line.positions)
    images = {
        name: backproject(scene.history.data, scene.positions, grid, threads=threads, **scene.arguments) for name, scene in scenes.items()
    }
    rows: list[dict[str, Any]] = [
        {"recording": "walk", "method": name, "sharpness": quality.sharpness(image), "entropy": quality.entropy(image)}
        | brightest(scenes[name], image, grid, threads)
        for name, image in images.items()
    ]
    reference = rows[0]["brightest_peak_db"]
    for row in rows:
        row["brightest_peak_db"] -= reference
    rows[2] |= summary(found)
    lines, estimated = rows[:2], rows[2]
    required = [
        at_least("walk: ridges that fit together", float(estimated["ridges"]), 4.0),
        at_least("walk: sharpness over that of the sharper line", estimated["sharpness"] / max(row["sharpness"] for row in lines), 1.5),
        at_most("walk: entropy less the lower of the lines'", estimated["entropy"] - min(row["entropy"] for row in lines), -0.3),
    ]
    return rows, required, {name: (image, []) for name, image in images.items()}


def brightest(scene: Scene, image: Complex, grid: ImageGrid, threads: int) -> dict[str, float]:
    """Return medians over the brightest scatterers of an image, each at least `APART` from the others along or across."""
    left = np.abs(image)
    around = round(APART / WALK_PIXEL)
    peaks = []
    for _ in range(BRIGHTEST):
        row, column = (int(at) for at in np.unravel_index(np.argmax(left), left.shape))
        peaks.append(peak_near(scene, np.asarray(grid.position(float(row), float(column))), threads, 0.25 * APART))
        left[max(0, row - around) : row + around + 1, max(0, column - around) : column + around + 1] = 0.0
    levels, coherences = [peak.level_db for peak in peaks], [peak.coherence for peak in peaks]
    return {"brightest_peak_db": float(np.median(levels)), "brightest_coherence": float(np.median(coherences))}


def walk_grid(positions: FloatArray) -> ImageGrid:
    """Return the plane of the track and look, along the track first."""
    along = positions @ ALONG
    first, last = along.min() - WALK_MARGIN, along.max() + WALK_MARGIN
    shape = (round((last - first) / WALK_PIXEL), round((WALK_DEPTH[1] - WALK_DEPTH[0]) / WALK_PIXEL))
    return ImageGrid.plane(first * ALONG + WALK_DEPTH[0] * LOOK, WALK_PIXEL * ALONG, WALK_PIXEL * LOOK, shape)


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw the reflectors, the difference of the paths and the walk; return the files written."""
    from ..report import trajectory_figures as figures  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.figures import save  # noqa: PLC0415

    rail_held: Mapping[str, Any] = result.pictures["rail"]
    walk_held: Mapping[str, Any] = result.pictures["walk"]
    made = {
        "rail": figures.chips_figure(rail_held["chips"], CHIP[1]),
        "scene": figures.scenes_figure(rail_held["scenes"], RAIL_PIXEL, (RAIL_DEPTH[0], -RAIL_HALF)),
        "path": figures.difference_figure(rail_held["difference"]),
        "walk": figures.scenes_figure(walk_held, WALK_PIXEL, (WALK_DEPTH[0], -0.5 * WALK_PIXEL * len(next(iter(walk_held.values()))[0]))),
    }
    paths = [folder / f"bwsi_trajectory_{name}.png" for name in made]
    for picture, path in zip(made.values(), paths, strict=True):
        save(picture, path)
    return paths
