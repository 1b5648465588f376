"""Figures of trajectories: reflectors close up, paths against one another, scenes before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from .figures import AFTER, BEFORE, INK, decibel, figure, style

CHIP_RANGE_DB, SCENE_RANGE_DB = 30.0, 40.0
FloatArray = npt.NDArray[np.float64]


def chips_figure(chips: Mapping[str, Sequence[npt.NDArray[Any]]], spacing: float) -> Figure:
    """Draw for each path (columns) the reflectors close up (rows), all on one scale."""
    count = len(next(iter(chips.values())))
    made = figure(2.7 * len(chips) + 0.9, 2.6 * count + 0.4)
    panels = made.subplots(count, len(chips), squeeze=False, sharex=True, sharey=True)
    reference = max(float(np.abs(image).max()) for images in chips.values() for image in images)
    shown = None
    for column, (title, images) in enumerate(chips.items()):
        for row, image in enumerate(images):
            axes = panels[row, column]
            half = 50.0 * spacing * np.array(image.shape)
            extent = (-half[1], half[1], -half[0], half[0])
            level = decibel(image, reference)
            shown = axes.imshow(level, cmap="gray", vmin=-CHIP_RANGE_DB, vmax=0.0, origin="lower", extent=extent)
            style(axes, grid=False)
            if column == 0:
                axes.set_ylabel(f"reflector {row + 1}\nalong the track (cm)")
        panels[0, column].set_title(title)
        panels[-1, column].set_xlabel("across (cm)")
        style(panels[0, column], grid=False)
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


def scenes_figure(images: Mapping[str, npt.NDArray[Any]], spacing: float) -> Figure:
    """Draw scenes side by side, each below its own brightest pixels, along the track upwards."""
    made = figure(3.4 * len(images) + 0.8, 5.6)
    panels = made.subplots(1, len(images), squeeze=False)[0]
    shown = None
    for axes, (title, image) in zip(panels, images.items(), strict=True):
        reference = float(np.percentile(np.abs(image), 99.95))
        extent = (0.0, spacing * image.shape[1], 0.0, spacing * image.shape[0])
        level = decibel(image, reference)
        shown = axes.imshow(level, cmap="gray", vmin=-SCENE_RANGE_DB, vmax=0.0, origin="lower", extent=extent, aspect="equal")
        axes.set(title=title, xlabel="across the track (m)")
        style(axes, grid=False)
    panels[0].set_ylabel("along the track (m)")
    bar = made.colorbar(shown, ax=list(panels), shrink=0.7, pad=0.015)
    bar.set_label("dB below the brightest pixels of each", color=INK, size=9)
    return made
