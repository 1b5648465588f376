"""Figures of scenes and of studies of one parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from .figures import AFTER, BEFORE, IDEAL, INK, LINE, SOFT, figure, style
from .strip_figures import OTHER

COLOURS = (BEFORE, OTHER, AFTER)
MARKERS = ("o", "s", "D", "^")
LEVELS_DB = (-15.0, 30.0)  # over the mean, of the images
FloatArray = npt.NDArray[np.float64]


def scenes_figure(scenes: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw for every scene the phases (``sample``, ``truth``, ``phases`` by method) and ``images``, amplitudes over their mean."""
    columns = max(len(scene["images"]) for scene in scenes.values())
    made = figure(3.0 + 2.1 * columns, 2.25 * len(scenes) + 0.7)
    grid = made.subplots(len(scenes), 1 + columns, squeeze=False, width_ratios=(1.6, *[1.0] * columns))
    shown = None
    for (name, scene), line in zip(scenes.items(), grid, strict=True):
        line[0].plot(scene["sample"], scene["truth"], color=IDEAL, linewidth=4.0, label="true")
        for (method, phase), colour in zip(scene["phases"].items(), COLOURS, strict=False):
            line[0].plot(scene["sample"], phase, color=colour, linewidth=1.1, label=method)
        low, high = float(np.min(scene["truth"])), float(np.max(scene["truth"]))
        reach = 0.5 * (high - low)  # what fails runs far away
        line[0].set(ylabel=f"scene {name}\nphase error (rad)", ylim=(low - reach, high + reach))
        style(line[0])
        for axes, (title, image) in zip(line[1:], scene["images"].items(), strict=True):
            level = 20.0 * np.log10(np.maximum(np.abs(image), 1e-6))
            shown = axes.imshow(level, cmap="gray", vmin=LEVELS_DB[0], vmax=LEVELS_DB[1], origin="lower", aspect="auto")
            axes.set_xticks([])
            axes.set_yticks([])
            axes.set_title(title.replace(", ", ",\n"))
            style(axes, grid=False)
    grid[-1][0].set_xlabel("azimuth frequency sample")
    grid[-1][1].set(xlabel="range", ylabel="azimuth")
    handles, labels = grid[0][0].get_legend_handles_labels()
    made.legend(handles, labels, frameon=False, fontsize=9, labelcolor=INK, ncols=len(labels), loc="outside upper left")
    if shown is not None:
        bar = made.colorbar(shown, ax=list(grid[:, -1]), pad=0.03)
        bar.set_label("dB over the mean", color=INK, size=9)
        bar.ax.tick_params(colors=SOFT, labelsize=8)
        bar.outline.set_edgecolor(LINE)
    return made


def study_figure(panels: Sequence[Mapping[str, Any]], x_label: str, ticks: Sequence[float | str], *, logarithmic: bool = False) -> Figure:
    """Draw panels side by side over one parameter.

    Parameters
    ----------
    panels : sequence of mappings
        ``title``, ``unit``, and ``lines``: by label, pairs of sequences; a label that ends in "(paper)" is drawn lightly.
    """
    columns = len(panels) if len(panels) < 4 else 2
    rows = -(-len(panels) // columns)
    made = figure(max(4.3 * columns, 5.4) + 0.4, 3.4 * rows + 0.2)
    for axes, panel in zip(made.subplots(rows, columns, squeeze=False).flat, panels, strict=True):
        own, quoted = 0, 0
        for label, (place, value) in panel["lines"].items():
            paper = label.endswith("(paper)")
            number = quoted if paper else own
            own, quoted = own + (not paper), quoted + paper
            look: dict[str, Any] = {"color": IDEAL, "linestyle": "--"} if paper else {"color": (AFTER, BEFORE, OTHER, INK)[number % 4]}
            axes.plot(place, value, marker=MARKERS[number % 4], markersize=4.0, linewidth=1.2, label=label, **look)
        axes.set(title=panel["title"], ylabel=panel["unit"], xlabel=x_label)
        if logarithmic:
            axes.set_xscale("log", base=2)
        if not isinstance(ticks[0], str):
            axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks], rotation=45 if len(ticks) > 9 else 0)
        axes.minorticks_off()
        if any(panel["lines"]):
            axes.legend(frameon=False, fontsize=8, labelcolor=INK)
        style(axes)
    return made


def times_figure(rows: Sequence[Mapping[str, Any]], allowed: float) -> Figure:
    """Draw the time of adaptive over that of conventional PGA, and multiples of a round trip, over the size, for three scenes."""
    sizes = list(dict.fromkeys((row["n_range"], row["n_azimuth"]) for row in rows))
    scenes = list(dict.fromkeys(row["case"].rpartition(", ")[0] for row in rows))
    made = figure(11.0, 4.0)
    left, right = made.subplots(1, 2)
    looks = {"conventional_pga": BEFORE, "pga_2d": OTHER, "adaptive_pga": AFTER}
    for scene, marker in zip(scenes, MARKERS, strict=False):
        for method, colour in looks.items():
            own = [row for row in rows if row["method"] == method and row["case"].startswith(scene)]
            place = np.array([sizes.index((row["n_range"], row["n_azimuth"])) for row in own], dtype=float)
            label = method if scene == scenes[0] else None
            right.plot(place, [row["round_trips"] for row in own], marker=marker, color=colour, linewidth=1.0, label=label)
            if method == "adaptive_pga":
                ratio = np.array([[row["over_conventional"], row["over_conventional_from"], row["over_conventional_to"]] for row in own])
                shift = 0.08 * (scenes.index(scene) - 1)
                bars = np.abs(ratio[:, 1:] - ratio[:, :1]).T
                left.errorbar(
                    place + shift, ratio[:, 0], yerr=bars, marker=marker, color=colour, capsize=2, linewidth=1.0, label=f"scene {scene}"
                )
                quoted = [row["paper_over_conventional"] for row in own]
                if None not in quoted:
                    left.plot(
                        place + shift, quoted, marker=marker, color=IDEAL, linestyle="--", linewidth=1.0, label=f"scene {scene} (paper)"
                    )
    left.axhline(allowed, color=INK, linewidth=0.9, linestyle=":")
    left.set(ylabel="time, adaptive over conventional PGA", xlabel="pixels, range x azimuth; bars: from the least to the largest")
    right.set(ylabel="time, azimuth round trips", xlabel="pixels, range x azimuth; markers as on the left", yscale="log")
    right.set_ylim(top=2.0 * right.get_ylim()[1])
    left.set_ylim(bottom=left.get_ylim()[0] - 0.25 * np.ptp(left.get_ylim()))
    for axes in (left, right):
        axes.set_xticks(range(len(sizes)), [f"{n_range} x\n{n_azimuth}" for n_range, n_azimuth in sizes])
        axes.legend(
            frameon=False, fontsize=7, labelcolor=INK, ncols=2 if axes is left else 3, loc="lower left" if axes is left else "upper right"
        )
        style(axes)
    return made
