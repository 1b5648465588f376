"""Figures of multichannel strips: points and scenes by several methods, cuts along azimuth, the motion found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from .figures import AFTER, BEFORE, IDEAL, INK, SOFT, decibel, figure, style

FloatArray = npt.NDArray[np.float64]
Images = Mapping[str, Mapping[str, npt.NDArray[Any]]]
Scenes = Mapping[str, npt.NDArray[Any]]
LEAST_DB = -40.0
BRIGHT_PERCENTILE = 99.9
REACH = 64  # pixels of azimuth either side
COLOURS = (IDEAL, SOFT, "#5b8c5a", BEFORE, AFTER)


def points_figure(images: Images, step: tuple[float, float], truth: FloatArray, motion: FloatArray) -> Figure:
    """Draw images [azimuth, range] by method (the first is ideal) and point, their cuts along azimuth, true and found motion (mm)."""
    methods, points = list(images), list(next(iter(images.values())))
    shown = methods[1:]
    made = figure(2.1 * len(shown) + 4.6, 2.1 * len(points) + 2.2)
    rows = made.add_gridspec(len(points) + 1, len(shown) + 2, height_ratios=[*([1.0] * len(points)), 0.9])
    for row, point in enumerate(points):
        reference = float(np.abs(images[methods[0]][point]).max())
        for column, method in enumerate(shown):
            axes = made.add_subplot(rows[row, column])
            map_of(axes, images[method][point], reference, step)
            axes.set_title(method if row == 0 else "", fontsize=10)
            axes.set_ylabel(f"{point}\nground range (m)" if column == 0 else "")
            axes.set_xlabel("azimuth (m)" if row == len(points) - 1 else "")
        cuts = made.add_subplot(rows[row, len(shown) :])
        for method, colour in zip(methods, COLOURS, strict=False):
            place, level = cut(images[method][point], reference, step[0])
            cuts.plot(place, level, color=colour, linewidth=3.0 if colour == IDEAL else 1.0, label=method)
        cuts.set(
            ylim=(LEAST_DB, 2.0), xlim=(-20.0, 20.0), ylabel="dB", xlabel="azimuth from the peak (m)" if row == len(points) - 1 else ""
        )
        style(cuts)
        if row == 0:
            cuts.legend(frameon=False, fontsize=7, labelcolor=INK, loc="upper right")
    motion_of(made.add_subplot(rows[len(points), :]), truth, motion)
    return made


def map_of(axes: Axes, image: npt.NDArray[Any], reference: float, step: tuple[float, float]) -> None:
    """Draw an image, azimuth to the right, dB over the peak of the ideal one."""
    middle = image.shape[0] // 2
    part = image[middle - REACH : middle + REACH]
    azimuth, ground = REACH * step[0], 0.5 * image.shape[1] * step[1]
    level = decibel(part.T, reference)
    axes.imshow(level, cmap="gray", vmin=LEAST_DB, vmax=0.0, origin="lower", extent=(-azimuth, azimuth, -ground, ground), aspect="auto")
    style(axes, grid=False)


def cut(image: npt.NDArray[Any], reference: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Return the cut along azimuth through the brightest pixel, eight times interpolated: m from it, dB."""
    at = np.unravel_index(int(np.argmax(np.abs(image))), image.shape)
    line = image[:, at[1]]
    n, fine = len(line), 8
    spectrum = np.fft.fftshift(np.fft.fft(line))
    padded = np.pad(spectrum, (n * (fine - 1) // 2, n * (fine - 1) // 2))
    smooth = fine * np.fft.ifft(np.fft.ifftshift(padded))
    place = (np.arange(n * fine) / fine - int(at[0])) * step
    return place, decibel(smooth, reference)


def motion_of(axes: Axes, truth: FloatArray, motion: FloatArray) -> None:
    """Draw the true height error, and what the one found leaves, without a line, on a scale of its own."""
    pulse = np.arange(len(truth))
    left = motion - truth
    left = left - np.polynomial.Polynomial.fit(pulse, left, 1)(pulse)
    axes.plot(pulse, truth, color=SOFT, linewidth=0.8, label="height error (mm)")
    axes.set(xlabel="pulse", ylabel="mm")
    style(axes)
    other = axes.twinx()
    other.plot(pulse, 1e3 * left, color=AFTER, linewidth=1.0, label="found less true, no line (µm)")
    other.set_ylabel("µm", color=AFTER)
    limit = 3.0 * float(np.abs(1e3 * left).max())
    other.set_ylim(-limit, limit)
    style(other, grid=False)
    lines = [*axes.get_lines(), *other.get_lines()]
    axes.legend(handles=lines, frameon=False, fontsize=8, labelcolor=INK, ncols=2, loc="upper right")
    axes.set_ylim(-20.0, 26.0)
    axes.margins(x=0)


def scene_figure(
    images: Scenes,
    reference: str,
    extent: tuple[float, float, float, float],
    *,
    columns: int,
    floor_db: float,
    box: tuple[float, float, float, float] | None = None,
) -> Figure:
    """Draw images [azimuth, range] in dB over a high percentile of the `reference`; extent and box (ground, along), m."""
    rows = -(-len(images) // columns)
    left, right, bottom, top = (1e-3 * edge for edge in extent)
    panel = 11.4 / columns
    height = float(np.clip(panel * (top - bottom) / (right - left), 1.1, 4.0))
    made = figure(panel * columns + 1.6, rows * (height + 0.45) + 0.4)
    panels = made.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    level = float(np.percentile(np.abs(images[reference]), BRIGHT_PERCENTILE))
    shown = None
    for axes, (title, image) in zip(panels.flat, images.items(), strict=False):
        shown = axes.imshow(
            decibel(image, level), cmap="gray", vmin=floor_db, vmax=0.0, origin="lower", extent=(left, right, bottom, top), aspect="auto"
        )
        axes.set_title(title)
        if box is not None:
            corner = (1e-3 * box[0], 1e-3 * box[2])
            axes.add_patch(
                Rectangle(corner, 1e-3 * (box[1] - box[0]), 1e-3 * (box[3] - box[2]), fill=False, edgecolor=BEFORE, linewidth=1.0)
            )
        style(axes, grid=False)
    for axes in panels.flat[len(images) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("azimuth (km)")
    for column in range(columns):
        last = [axes for axes in panels[:, column] if axes.get_visible()][-1]
        last.set_xlabel("ground range (km)")
        last.tick_params(labelbottom=True)
        last.xaxis.set_major_locator(MaxNLocator(5))
    if shown is not None:
        bar = made.colorbar(shown, ax=panels, shrink=0.6, pad=0.015)
        bar.set_label(f"dB over the {BRIGHT_PERCENTILE:g}th percentile with the true motion", color=INK, size=8)
        bar.ax.tick_params(colors=SOFT, labelsize=8)
    return made


def residual_figure(truth: FloatArray, left: FloatArray, deviation: FloatArray, wavelength: float) -> Figure:
    """Draw the true height error and what the one found leaves, pulse by pulse (m)."""
    made = figure(9.6, 4.4)
    above, below = made.subplots(2, 1, sharex=True)
    pulse = np.arange(len(truth))
    above.plot(pulse, truth / wavelength, color=SOFT, linewidth=0.5)
    above.set(ylabel="height error\n(wavelengths)")
    below.fill_between(pulse, -2e3 * deviation / wavelength, 2e3 * deviation / wavelength, color=IDEAL, linewidth=0.0, alpha=0.5)
    below.plot(pulse, 1e3 * left / wavelength, color=AFTER, linewidth=0.6)
    below.set(ylabel="found less true, no line\n(1/1000 wavelengths)", xlabel="pulse (band: two stated standard deviations)")
    for axes in (above, below):
        style(axes)
        axes.margins(x=0)
    return made
