"""Figures, drawn through matplotlib's object interface: no global state, no display."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

INK, SOFT, LINE = "#1c2430", "#5a6675", "#d9dee5"
BEFORE, AFTER, IDEAL = "#c2571a", "#1f5c99", "#aab3bd"
LABELS = {"before": "before", "after": "after", "ideal": "error-free"}
DPI = 150
DYNAMIC_RANGE_DB = 50.0
FloatArray = npt.NDArray[np.float64]


def figure(width: float, height: float) -> Figure:
    """Return an empty figure, inches."""
    made = Figure(figsize=(width, height), dpi=DPI, layout="constrained", facecolor="white")
    FigureCanvasAgg(made)
    return made


def style(axes: Axes, *, grid: bool = True) -> None:
    """Give the axes the look of the package."""
    axes.tick_params(colors=SOFT, labelsize=8, length=3)
    axes.xaxis.label.set(color=INK, size=9)
    axes.yaxis.label.set(color=INK, size=9)
    axes.title.set(color=INK, size=10)
    for spine in axes.spines.values():
        spine.set_color(LINE)
    if grid:
        axes.grid(color=LINE, linewidth=0.6)
        axes.set_axisbelow(True)


def png(made: Figure) -> bytes:
    """Return the figure as a PNG file."""
    stream = io.BytesIO()
    made.savefig(stream, format="png")
    return stream.getvalue()


def data_uri(made: Figure) -> str:
    """Return the figure as a data URI."""
    return "data:image/png;base64," + base64.b64encode(png(made)).decode("ascii")


def save(made: Figure, path: Path) -> None:
    """Write the figure as a PNG file."""
    path.write_bytes(png(made))


def decibel(image: npt.NDArray[Any], reference: float) -> FloatArray:
    """Return the magnitude in dB relative to `reference`."""
    level: FloatArray = 20.0 * np.log10(np.maximum(np.abs(image), 1e-12 * reference) / reference)
    return level


def image_figure(
    images: Mapping[str, npt.NDArray[Any]], spacing: tuple[float, float] | None, marks: Sequence[tuple[float, float]] = ()
) -> Figure:
    """Images side by side in dB, on one scale and with one colour bar; `marks` are pixels (azimuth, range) to circle and number."""
    reference = max(float(np.abs(image).max()) for image in images.values())
    rows, columns = next(iter(images.values())).shape
    unit, (azimuth, ground) = ("m", spacing) if spacing else ("pixels", (1.0, 1.0))
    panel = 4.6
    height = float(np.clip(panel * rows * azimuth / (columns * ground), 1.6, 8.0))
    made = figure(panel * len(images) + 0.9, height + 0.7)
    panels = made.subplots(1, len(images), squeeze=False, sharey=True)[0]
    extent = (-0.5 * ground, (columns - 0.5) * ground, -0.5 * azimuth, (rows - 0.5) * azimuth)
    shown = None
    for axes, (title, image) in zip(panels, images.items(), strict=True):
        shown = axes.imshow(
            decibel(image, reference),
            cmap="gray",
            vmin=-DYNAMIC_RANGE_DB,
            vmax=0.0,
            origin="lower",
            extent=extent,
            interpolation="antialiased",
        )
        axes.set(title=title, xlabel=f"range ({unit})")
        style(axes, grid=False)
        for number, (i, j) in enumerate(marks, start=1):
            axes.plot(j * ground, i * azimuth, "o", markersize=13, markerfacecolor="none", markeredgecolor="#f2a33a", markeredgewidth=1.0)
            axes.annotate(
                str(number), (j * ground, i * azimuth), xytext=(7, 6), textcoords="offset points", color="#f2a33a", size=8, weight="bold"
            )
    panels[0].set_ylabel(f"azimuth ({unit})")
    if shown is not None:
        bar = made.colorbar(shown, ax=list(panels), shrink=0.82, pad=0.015)
        bar.set_label("magnitude, dB below the brightest pixel of all", color=INK, size=9)
        bar.ax.tick_params(colors=SOFT, labelsize=8)
        bar.outline.set_edgecolor(LINE)
    return made


def phase_figure(estimate: FloatArray, deviation: FloatArray | None, truth: FloatArray | None, axis: str) -> Figure:
    """Phase error with its band of one standard deviation; with a known truth, that too and what is left between them."""
    made = figure(9.6, 4.6 if truth is not None else 3.2)
    if truth is None:
        upper, lower = made.subplots(1, 1), None
    else:
        upper, lower = made.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    index = np.arange(len(estimate))
    if truth is not None:
        upper.plot(index, truth, color=IDEAL, linewidth=2.6, label="true")
    upper.plot(index, estimate, color=AFTER, linewidth=1.2, label="estimated")
    if deviation is not None:
        low, high = estimate - deviation, estimate + deviation
        upper.fill_between(index, low, high, color=AFTER, alpha=0.25, linewidth=0, label="one standard deviation")
    upper.set_ylabel("phase error (rad)")
    upper.legend(frameon=False, fontsize=8, labelcolor=INK, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    style(upper)
    bottom = upper
    if lower is not None and truth is not None:
        bottom = lower
        lower.plot(index, estimate - truth, color=AFTER, linewidth=0.9)
        if deviation is not None:
            lower.fill_between(index, -deviation, deviation, color=AFTER, alpha=0.25, linewidth=0)
        lower.set_ylabel("difference (rad)")
        style(lower)
    bottom.set_xlabel(axis)
    bottom.set_xlim(0, len(index) - 1)
    return made


def cuts_figure(cuts: Sequence[tuple[str, Mapping[str, tuple[FloatArray, FloatArray]]]], unit: str) -> Figure:
    """Azimuth cuts through points: for each a title and, by name, positions and levels in dB."""
    colours = {"before": (BEFORE, 1.1), "after": (AFTER, 1.5), "ideal": (IDEAL, 3.0)}
    made = figure(9.6, 3.3)
    panels = made.subplots(1, len(cuts), squeeze=False, sharey=True)[0]
    for axes, (title, lines) in zip(panels, cuts, strict=True):
        for name in sorted(lines, key=list(colours).index, reverse=True):
            colour, width = colours[name]
            axes.plot(*lines[name], color=colour, linewidth=width, label=LABELS[name])
        axes.set(title=title, xlabel=f"azimuth from the peak ({unit})", ylim=(-45.0, 3.0))
        axes.margins(x=0)
        style(axes)
    panels[0].set_ylabel("dB")
    handles, labels = panels[0].get_legend_handles_labels()
    made.legend(handles, labels, frameon=False, fontsize=8, labelcolor=INK, ncols=3, loc="outside upper right")
    return made


def bound_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Error of the phase estimators against the Cramer-Rao bound, over the signal-to-noise ratio."""
    made = figure(6.4, 4.0)
    axes = made.subplots(1, 1)
    looks = {"ml": (AFTER, "o", "maximum likelihood"), "gradient": (BEFORE, "s", "phase gradient")}
    for method, (colour, marker, label) in looks.items():
        chosen = [row for row in rows if row["method"] == method]
        axes.errorbar(
            [row["snr_db"] for row in chosen],
            [row["rmse"] for row in chosen],
            yerr=[row["standard_error"] for row in chosen],
            color=colour, marker=marker, markersize=5, linewidth=1.3, capsize=2, label=label,
        )  # fmt: skip
    bound = sorted({(row["snr_db"], row["bound"]) for row in rows})
    axes.plot(*zip(*bound, strict=True), color=INK, linestyle="--", linewidth=1.1, label="Cramér–Rao bound")
    axes.set(yscale="log", xlabel="signal-to-noise ratio per sample (dB)", ylabel="phase RMSE (rad)")
    axes.set_xticks([snr_db for snr_db, _ in bound])
    axes.legend(frameon=False, fontsize=8, labelcolor=INK)
    style(axes)
    axes.grid(which="minor", color=LINE, linewidth=0.3)
    return made
