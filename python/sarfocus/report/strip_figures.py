"""Figures of strips: phases over slow time, seams, displaced points, the matrix of the search, the strip itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from .figures import AFTER, BEFORE, DYNAMIC_RANGE_DB, IDEAL, INK, LINE, SOFT, figure, style

OTHER = "#7a4fa3"
MARK = "#f2a33a"
LIGHT = 0.02  # weight over the largest, of seams that do not set the scale
STRIP_RANGE_DB, BRIGHTEST = 35.0, 99.995  # of a strip's picture; percentile that is white
LONGEST = 1400  # pixels of a strip's picture along azimuth
Lines = Mapping[str, tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]]
FloatArray = npt.NDArray[np.float64]


def phases_figure(truth: FloatArray, estimates: Mapping[str, FloatArray], places: Sequence[float] = ()) -> Figure:
    """Draw the true phase error and several estimates of it, all in one gauge, and below what they leave; `places`: azimuth of points."""
    made = figure(9.6, 5.4)
    upper, lower = made.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    upper.plot(truth, color=IDEAL, linewidth=4.0, label="true")
    looks = zip(estimates.items(), ((BEFORE, 1.0), (OTHER, 1.0), (AFTER, 1.4)), strict=False)
    for (name, estimate), (colour, width) in looks:
        upper.plot(estimate, color=colour, linewidth=width, label=name)
        lower.plot(estimate - truth, color=colour, linewidth=width)
    for place in places:
        upper.axvline(place, color=LINE, linewidth=0.8, zorder=0)
    upper.set_ylabel("phase error (rad)")
    upper.legend(frameon=False, fontsize=8, labelcolor=INK, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    lower.set(ylabel="difference (rad)", xlabel="azimuth sample (slow time)", xlim=(0, len(truth) - 1))
    style(upper)
    style(lower)
    return made


def band_figure(panels: Sequence[tuple[str, FloatArray, FloatArray, FloatArray]]) -> Figure:
    """Draw for each panel (title, truth, estimate, standard deviation) the phases and their difference with the band of two deviations."""
    made = figure(9.6, 2.6 * len(panels) + 0.6)
    grid = made.subplots(len(panels), 2, squeeze=False, sharex=True, width_ratios=(1.15, 1.0))
    for (title, truth, estimate, deviation), (left, right) in zip(panels, grid, strict=True):
        left.plot(truth, color=IDEAL, linewidth=3.2, label="true")
        left.plot(estimate, color=AFTER, linewidth=1.1, label="estimated")
        left.set(title=title, ylabel="phase error (rad)")
        index = np.arange(len(truth))
        right.fill_between(index, -2.0 * deviation, 2.0 * deviation, color=AFTER, alpha=0.22, linewidth=0, label="two standard deviations")
        right.plot(estimate - truth, color=AFTER, linewidth=0.8, label="estimated less true")
        right.set(ylabel="difference (rad)", xlim=(0, len(truth) - 1))
        style(left)
        style(right)
    for axes in grid[-1]:
        axes.set_xlabel("azimuth sample (slow time)")
    for axes in grid[0]:
        axes.legend(frameon=False, fontsize=8, labelcolor=INK, loc="best")
    return made


def seams_figure(seams: Mapping[str, Any], azimuth: FloatArray, reach: FloatArray, pixels: FloatArray) -> Figure:
    """Draw the apertures and what stitching leaves of every seam it used; areas are weights, the lightest seams may lie outside.

    Parameters
    ----------
    seams : mapping
        As in the diagnostics of `sarfocus.spga_linear`.
    azimuth, reach : float64 [n_point]
        Place of a point and half its aperture, samples.
    pixels : float64 [n_point]
        Displacement, pixels, of a point by a slope of 1 rad a sample.
    """
    made = figure(9.6, 5.0)
    upper, lower = made.subplots(2, 1, sharex=True)
    for n, (place, half) in enumerate(zip(azimuth, reach, strict=True)):
        upper.plot([place - half, place + half], [n, n], color=AFTER, linewidth=1.4 if len(azimuth) > 20 else 3.0, solid_capstyle="butt")
        upper.plot(place, n, "o", color=MARK, markersize=3.0 if len(azimuth) > 20 else 6.0)
    upper.set(ylabel="point, with its aperture")
    first, second = np.asarray(seams["first"], dtype=int), np.asarray(seams["second"], dtype=int)
    weight = np.asarray(seams["weight"], dtype=np.float64)
    left = np.asarray(seams["residual"], dtype=np.float64) * 0.5 * (pixels[first] + pixels[second])
    middle = 0.5 * (azimuth[first] + azimuth[second])
    share = weight / max(float(weight.max(initial=0.0)), 1e-30)
    used = share > 0
    lower.scatter(middle[used], left[used], s=4.0 + 60.0 * share[used], color=AFTER, alpha=0.6, linewidths=0)
    span = 1.3 * float(np.abs(left[share > LIGHT]).max(initial=1e-6))
    lower.set(ylabel="residual of the seam (pixels)", xlabel="azimuth (pixels): middle of the overlap", ylim=(-span, span))
    style(upper)
    style(lower)
    return made


def displacement_figure(azimuth: FloatArray, before: FloatArray, after: FloatArray) -> Figure:
    """Draw by how much known targets (azimuth in m) are displaced along azimuth (m), before and after."""
    made = figure(9.6, 3.0)
    axes = made.subplots(1, 1)
    axes.plot(azimuth, before, "s", color=BEFORE, markersize=4.5, label="before")
    axes.plot(azimuth, after, "o", color=AFTER, markersize=4.5, label="after")
    axes.set(xlabel="azimuth (m)", ylabel="displacement (m)")
    axes.legend(frameon=False, fontsize=8, labelcolor=INK, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    style(axes)
    return made


def points_figure(panels: Sequence[tuple[str, Lines]]) -> Figure:
    """Draw azimuth cuts of points about their true places: for each a title and, by name, positions (pixels) and amplitudes."""
    columns = min(4, len(panels))
    rows = -(-len(panels) // columns)
    made = figure(2.7 * columns, 2.4 * rows + 0.5)
    grid = made.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    colours = (IDEAL, BEFORE, OTHER, AFTER)
    for axes in grid.flat:
        axes.set_visible(False)
    for (title, lines), axes in zip(panels, grid.flat, strict=False):
        axes.set_visible(True)
        for (name, (position, amplitude)), colour in zip(lines.items(), colours, strict=False):
            level = 20.0 * np.log10(np.maximum(amplitude, 1e-5))
            axes.plot(position, level, color=colour, linewidth=3.0 if colour == IDEAL else 1.1, label=name)
        axes.set(title=title, ylim=(-40.0, 2.0))
        axes.margins(x=0)
        axes.xaxis.set_tick_params(labelbottom=True)
        style(axes)
    grid[-1][0].set_xlabel("azimuth from the true place (pixels)")
    grid[0][0].set_ylabel("dB over the error-free peak")
    handles, labels = grid[0][0].get_legend_handles_labels()
    made.legend(handles, labels, frameon=False, fontsize=9, labelcolor=INK, ncols=len(labels), loc="outside upper right")
    return made


def matrix_figure(matrix: FloatArray) -> Figure:
    """Draw |R(i, j)| of the search: as a map, and every eighth column as a curve [Xie2023, fig. 7]."""
    width = len(matrix)
    offset = np.arange(width) - width // 2
    made = figure(9.6, 4.0)
    left, right = made.subplots(1, 2)
    shown = left.imshow(matrix, origin="lower", extent=(offset[0] - 0.5, offset[-1] + 0.5) * 2, cmap="viridis")
    left.set(xlabel="displacement of the second point (pixels)", ylabel="displacement of the first point (pixels)")
    bar = made.colorbar(shown, ax=left, shrink=0.9)
    bar.set_label("|R|, rad a sample", color=INK, size=9)
    bar.ax.tick_params(colors=SOFT, labelsize=8)
    for j in range(0, width, max(1, width // 8)):
        right.plot(offset, matrix[:, j], linewidth=1.1, label=f"{offset[j]:+d}")
    right.set(xlabel="displacement of the first point (pixels)", ylabel="|R|, rad a sample", ylim=(0.0, None))
    right.legend(frameon=False, fontsize=8, labelcolor=INK, title="second point", title_fontsize=8, ncols=2)
    style(left, grid=False)
    style(right)
    return made


def thinned(image: npt.NDArray[Any], factor: int) -> FloatArray:
    """Return the intensity, averaged over blocks of `factor` azimuth pixels; what does not fill a block is left out."""
    rows = image.shape[0] // factor * factor
    mean: FloatArray = (np.abs(image[:rows]) ** 2).astype(np.float64).reshape(-1, factor, image.shape[1]).mean(axis=1)
    return mean


def strip_figure(images: Mapping[str, npt.NDArray[Any]], spacing: tuple[float, float], marks: Sequence[tuple[float, float]] = ()) -> Figure:
    """Draw strips above one another in dB on one scale, azimuth to the right; `marks`: pixels (azimuth, range) to circle and number."""
    n_azimuth, n_range = next(iter(images.values())).shape
    factor = -(-n_azimuth // LONGEST)
    powers = {name: thinned(image, factor) for name, image in images.items()}
    top = max(float(np.percentile(power, BRIGHTEST)) for power in powers.values())
    length, across = n_azimuth * spacing[0], n_range * spacing[1]
    made = figure(9.6, len(images) * float(np.clip(8.3 * across / length, 0.8, 4.5)) + 0.9)
    panels = made.subplots(len(images), 1, squeeze=False, sharex=True)[:, 0]
    shown = None
    for axes, (name, power) in zip(panels, powers.items(), strict=True):
        level = 10.0 * np.log10(np.maximum(power.T, 1e-12 * top) / top)
        shown = axes.imshow(
            level, cmap="gray", vmin=-STRIP_RANGE_DB, vmax=0.0, origin="lower", extent=(0, length, 0, across), aspect="auto"
        )
        for number, (i, j) in enumerate(marks, start=1):
            at = (i * spacing[0], j * spacing[1])
            axes.plot(*at, "o", markersize=10, markerfacecolor="none", markeredgecolor=MARK, markeredgewidth=0.9)
            axes.annotate(str(number), at, xytext=(5, 5), textcoords="offset points", color=MARK, size=8, weight="bold")
        axes.set_ylabel(f"{name}\nrange (m)")
        style(axes, grid=False)
    panels[-1].set_xlabel("azimuth (m)")
    if shown is not None:
        bar = made.colorbar(shown, ax=list(panels), pad=0.015, shrink=0.9)
        bar.set_label("dB", color=INK, size=9)
        bar.ax.tick_params(colors=SOFT, labelsize=8)
        bar.outline.set_edgecolor(LINE)
    return made


def crops_figure(images: Mapping[str, npt.NDArray[Any]], places: Sequence[tuple[float, float]], half: tuple[int, int] = (48, 12)) -> Figure:
    """Draw the surroundings of a few pixels, one row for each, one column for each image, on one scale; a cross marks the place itself."""
    made = figure(3.1 * len(images) + 0.6, 1.15 * len(places) + 0.7)
    grid = made.subplots(len(places), len(images), squeeze=False, sharex=True, sharey="row")
    top = max(float(np.abs(image).max()) for image in images.values())
    n_azimuth, n_range = next(iter(images.values())).shape
    for name, axes in zip(images, grid[0], strict=True):
        axes.set_title(name)
    for (azimuth, gate), line in zip(places, grid, strict=True):
        first, last = max(0, round(azimuth) - half[0]), min(n_azimuth, round(azimuth) + half[0] + 1)
        low, high = max(0, round(gate) - half[1]), min(n_range, round(gate) + half[1] + 1)
        extent = (first - azimuth - 0.5, last - azimuth - 0.5, low - gate - 0.5, high - gate - 0.5)
        for axes, image in zip(line, images.values(), strict=True):
            level = 20.0 * np.log10(np.maximum(np.abs(image[first:last, low:high]).T / top, 1e-6))
            axes.imshow(level, cmap="gray", vmin=-DYNAMIC_RANGE_DB, vmax=0.0, origin="lower", extent=extent, aspect="auto")
            axes.axvline(0.0, color=MARK, linewidth=0.7, ymin=0.0, ymax=0.18)
            axes.axvline(0.0, color=MARK, linewidth=0.7, ymin=0.82, ymax=1.0)
            style(axes, grid=False)
        line[0].set_ylabel(f"{azimuth:.0f}, {gate:.0f}")
    for axes in grid[-1]:
        axes.set_xlabel("azimuth from the true place (pixels)")
    return made
