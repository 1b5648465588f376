"""Figures of trajectories: reflectors close up, paths against one another, scenes before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from .figures import AFTER, BEFORE, INK, decibel, figure, style

CHIP_RANGE_DB, SCENE_RANGE_DB = 30.0, 35.0
FloatArray = npt.NDArray[np.float64]
Place = tuple[float, float]  # m: across, along the track


def chips_figure(chips: Mapping[str, Sequence[tuple[npt.NDArray[Any], Place]]], spacing: float) -> Figure:
    """Draw for each path (columns) the reflectors close up (rows), all on one scale; marked where they were expected."""
    count = len(next(iter(chips.values())))
    made = figure(2.7 * len(chips) + 0.9, 2.6 * count + 0.4)
    panels = made.subplots(count, len(chips), squeeze=False, sharex=True, sharey=True)
    reference = max(float(np.abs(image).max()) for images in chips.values() for image, _ in images)
    shown: AxesImage | None = None
    for column, (title, images) in enumerate(chips.items()):
        for row, (image, expected) in enumerate(images):
            axes = panels[row, column]
            half = 50.0 * spacing * np.array(image.shape)
            extent = (-half[1], half[1], -half[0], half[0])
            level = decibel(image, reference)
            shown = axes.imshow(level, cmap="gray", vmin=-CHIP_RANGE_DB, vmax=0.0, origin="lower", extent=extent)
            mark(axes, [(100.0 * expected[0], 100.0 * expected[1])])
            style(axes, grid=False)
            if column == 0:
                axes.set_ylabel(f"reflector {row + 1}\nalong the track (cm)")
        panels[0, column].set_title(title)
        panels[-1, column].set_xlabel("slant range (cm)")
        style(panels[0, column], grid=False)
    assert shown is not None
    bar = made.colorbar(shown, ax=panels, shrink=0.8, pad=0.015)
    bar.set_label("dB below the brightest of all", color=INK, size=9)
    return made


def difference_figure(difference: Mapping[str, FloatArray]) -> Figure:
    """Draw the estimated path less the captured one along the track, with the band of two standard deviations."""
    made = figure(7.2, 3.2)
    axes = made.subplots(1, 1)
    deviation = 2000.0 * difference["deviation"]
    index = np.arange(len(deviation))
    axes.fill_between(index, -deviation, deviation, color=AFTER, alpha=0.18, linewidth=0, label="two standard deviations")
    for (name, values), colour in zip(difference.items(), (BEFORE, AFTER), strict=False):
        axes.plot(index, 1000.0 * values, color=colour, linewidth=1.3, label=name)
    axes.set(xlabel="pulse", ylabel="along the track, estimate less capture (mm)", xlim=(0, len(index) - 1))
    axes.legend(frameon=False, fontsize=8, labelcolor=INK, ncols=3)
    style(axes)
    return made


def scenes_figure(scenes: Mapping[str, tuple[npt.NDArray[Any], Sequence[Place]]], spacing: float, corner: Place) -> Figure:
    """Draw scenes side by side, each below its own brightest pixels, along the track upwards; scatterers marked."""
    shape = np.array(next(iter(scenes.values()))[0].shape)
    extent = (corner[0], corner[0] + spacing * shape[1], corner[1], corner[1] + spacing * shape[0])
    made = figure(3.0 * len(scenes) + 0.8, 2.7 * shape[0] / shape[1] + 0.7)
    panels = made.subplots(1, len(scenes), squeeze=False, sharey=True)[0]
    shown: AxesImage | None = None
    for axes, (title, (image, places)) in zip(panels, scenes.items(), strict=True):
        level = decibel(image, float(np.percentile(np.abs(image), 99.95)))
        shown = axes.imshow(level, cmap="gray", vmin=-SCENE_RANGE_DB, vmax=0.0, origin="lower", extent=extent, aspect="equal")
        axes.set(title=title, xlabel="slant range from the track (m)")
        mark(axes, places)
        style(axes, grid=False)
    panels[0].set_ylabel("along the track (m)")
    assert shown is not None
    bar = made.colorbar(shown, ax=list(panels), shrink=0.7, pad=0.015)
    bar.set_label("dB below the brightest 0.05 % of each", color=INK, size=9)
    return made


def mark(axes: Axes, places: Sequence[Place]) -> None:
    """Ring the places."""
    for across, along in places:
        axes.plot(across, along, "o", markersize=13, markerfacecolor="none", markeredgecolor=BEFORE, markeredgewidth=1.2)
