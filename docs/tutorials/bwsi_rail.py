"""Picture and figures of the rail tutorial: python docs/tutorials/bwsi_rail.py RECORDING.npz -o docs/pictures/bwsi_rail.png."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

import sarfocus
from sarfocus import quality
from sarfocus.focusing import form_image
from sarfocus.io import Image, PhaseHistory, read_bwsi
from sarfocus.motion import along_path, synchronised

mpl.use("Agg")
from matplotlib import pyplot as plt

# Points of the phase estimate: a few strong scatterers in a scene of a few metres, so a narrow window and only what stands out.
FEW_POINTS: dict[str, Any] = {"coarse_windows": (1 / 16, 1 / 16), "coarse_points": 10, "minimum_contrast": 40.0}
DYNAMIC_RANGE = 40.0  # dB


def scene(reflectors: np.ndarray) -> sarfocus.ImageGrid:
    """Return a horizontal grid, 3 cm apart, that reaches 1.7 m beyond the reflectors."""
    low = reflectors.min(axis=0) - (1.7, 1.7, 0.0)
    size = np.ptp(reflectors, axis=0)[:2] + 3.4
    return sarfocus.ImageGrid.plane(low, (0.0, 0.03, 0.0), (0.03, 0.0, 0.0), (round(size[1] / 0.03), round(size[0] / 0.03)))


def chip(history: PhaseHistory, centre: np.ndarray) -> Image:
    """Form 0.8 m x 0.8 m round a reflector, 5 mm apart."""
    grid = sarfocus.ImageGrid.plane(centre - (0.4, 0.4, 0.0), (0.0, 0.005, 0.0), (0.005, 0.0, 0.0), (161, 161))
    return form_image(history, grid)


def measured(history: PhaseHistory, reflectors: np.ndarray) -> list[dict[str, float]]:
    """Peak (dB) and widths at -3 dB (m, y and x) of every reflector."""
    out = []
    for centre in reflectors:
        data = chip(history, centre).data
        place = np.unravel_index(np.argmax(np.abs(data)), data.shape)
        response = quality.point_response(data, place, upsample=8)
        out.append(
            {
                "peak_db": 20 * float(np.log10(np.abs(data).max())),
                "width_y": 0.005 * float(response.azimuth.irw),
                "width_x": 0.005 * float(response.range.irw),
            }
        )
    return out


def stages(history: PhaseHistory, grid: sarfocus.ImageGrid) -> tuple[dict[str, PhaseHistory], dict[str, Any]]:
    """Return the phase history as recorded, with the time offset found, and with a phase for every pulse; and what was found."""
    placed, clocks = synchronised(history, grid)
    path = along_path(placed)
    arguments = {name: getattr(path, name) for name in ("range_start", "range_spacing", "wavelength")}
    judged = sarfocus.gpga(path.data, path.positions, grid, **arguments)
    few = sarfocus.gpga(path.data, path.positions, grid, **arguments, **FEW_POINTS, do_no_harm=False)
    turned = (path.data * np.exp(-1j * few.phase_error)[:, None]).astype(np.complex64)
    found = {
        "time_offset": {"recorded": history.track.offset if history.track else None, "estimate": clocks.estimate, "std": clocks.offset_std},
        "time_offset_reason": clocks.reason,
        "gpga": judged.status.name,
        "gpga_reason": judged.diagnostics["score"]["reason"],
        "phase_rms": float(np.sqrt(np.mean(few.phase_error**2))),
    }
    steps = {
        "as recorded": along_path(history),
        f"time offset {clocks.offset:.4f} s": path,
        "and a phase per pulse": dataclasses.replace(path, data=turned),
    }
    return steps, found


def draw(steps: dict[str, PhaseHistory], grid: sarfocus.ImageGrid, reflectors: np.ndarray, target: Path) -> None:
    """Three images and, below, both reflectors close up, all on one scale."""
    images = {name: form_image(history, grid).data for name, history in steps.items()}
    top = max(20 * np.log10(np.abs(data).max()) for data in images.values())
    positions = grid.positions()
    figure, axes = plt.subplots(3, 3, figsize=(9.0, 10.0), height_ratios=(2.4, 1, 1), layout="constrained")
    for column, (name, history) in enumerate(steps.items()):
        extent = (positions[0, 0, 0], positions[0, -1, 0], positions[0, 0, 1], positions[-1, 0, 1])
        picture = show(axes[0, column], images[name], extent, top)
        axes[0, column].set_title(name)
        axes[0, column].plot(reflectors[:, 0], reflectors[:, 1], "o", mfc="none", mec="tab:red", ms=14)
        for row, centre in enumerate(reflectors, start=1):
            x, y = centre[:2]
            show(axes[row, column], chip(history, centre).data, (x - 0.4, x + 0.4, y - 0.4, y + 0.4), top)
            axes[row, column].plot(x, y, "+", color="tab:red")
    for row in range(3):
        axes[row, 0].set_ylabel("y (m)")
    for column in range(3):
        axes[2, column].set_xlabel("x (m)")
    figure.colorbar(picture, ax=axes, label="dB of the brightest pixel", shrink=0.5)
    figure.savefig(target, dpi=72)


def show(axis: Any, data: np.ndarray, extent: tuple[float, float, float, float], top: float) -> Any:
    """Draw the level in dB below `top`."""
    level = 20 * np.log10(np.maximum(np.abs(data), 1e-12)) - top
    return axis.imshow(level, origin="lower", extent=extent, vmin=-DYNAMIC_RANGE, vmax=0, cmap="gray", interpolation="nearest")


def main() -> None:
    """Read the recording, draw the picture, print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("bwsi_rail.png"))
    arguments = parser.parse_args()
    history = read_bwsi(arguments.recording)
    reflectors = np.asarray(history.metadata["reflectors"])
    grid = scene(reflectors)
    steps, found = stages(history, grid)
    draw(steps, grid, reflectors, arguments.output)
    figures = {name: measured(item, reflectors) for name, item in steps.items()}
    json.dump(found | {"reflectors": figures}, sys.stdout, indent=2)
    sys.stdout.write("\n")


if __name__ == "__main__":
    main()
