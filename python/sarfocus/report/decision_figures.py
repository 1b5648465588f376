"""Pictures of decisions: methods tried, sub-apertures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from .figures import AFTER, BEFORE, IDEAL, INK, LINE, SOFT, figure, style

FLOOR = 0.7  # where bars on a logarithmic axis of whole numbers begin


def trials_figure(trials: Sequence[dict[str, Any]]) -> Figure:
    """Mean gain of held-back points of every method, with three standard errors."""
    made = figure(8.4, 0.42 * len(trials) + 1.0)
    axes = made.subplots()
    places = np.arange(len(trials))[::-1]
    for place, trial in zip(places, trials, strict=True):
        colour = AFTER if trial["chosen"] else SOFT
        error = 3.0 * trial["held_out_std_db"]
        axes.errorbar(trial["held_out_gain_db"], place, xerr=error, color=colour, capsize=3, linewidth=1.2, zorder=2)
        face = colour if trial["chosen"] else "white"
        axes.plot(trial["held_out_gain_db"], place, "o", markersize=6, markerfacecolor=face, markeredgecolor=colour, zorder=3)
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_yticks(places, [trial["method"] for trial in trials])
    axes.set(xlabel="gain of held-back strong points (dB)", ylim=(-0.6, len(trials) - 0.4))
    style(axes)
    return made


def sub_apertures_figure(parts: Sequence[dict[str, Any]], eta: float) -> Figure:
    """Range gates used in every azimuth sub-aperture, and how far they stand out."""
    middle = np.array([part["first"] + 0.5 * part["count"] for part in parts])
    gates = np.array([part["gates"] for part in parts])
    rest = np.array([part["mean_rest"] for part in parts])
    strong = np.array([part["mean_strong"] for part in parts])
    ratio = np.divide(strong, rest, out=np.full(len(parts), np.nan), where=rest > 0)
    width = 0.42 * (parts[1]["first"] - parts[0]["first"]) if len(parts) > 1 else 0.42 * parts[0]["count"]
    made = figure(9.6, 4.0)
    above, below = made.subplots(2, 1, sharex=True)
    above.bar(middle, np.maximum(gates - FLOOR, 0.0), bottom=FLOOR, width=2.0 * width, color=AFTER, edgecolor="white", linewidth=0.5)
    for place in middle[gates == 0]:
        above.annotate("skipped", (place, 1.05 * FLOOR), ha="center", va="bottom", rotation=90, color=BEFORE, size=8)
    above.set(ylabel="range gates, k", yscale="log", ylim=(FLOOR, 1.5 * max(float(gates.max()), 4.0)))
    _ticks(above, [2.0**n for n in range(12)])
    below.axhline(eta, color=BEFORE, linewidth=1.0, linestyle="--")
    below.annotate(f"eta = {eta:g}", (1.0, eta), xycoords=("axes fraction", "data"), ha="right", va="bottom", color=BEFORE, size=8)
    below.plot(middle, ratio, "o-", color=SOFT, markersize=4, linewidth=0.8, markerfacecolor=IDEAL, markeredgecolor=SOFT)
    below.set(xlabel="azimuth (lines)", ylabel="energy ratio m1 / m2", yscale="log")
    _ticks(below, [1, 1.5, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000, 1e4, 1e5])
    for axes in (above, below):
        style(axes)
        axes.spines["bottom"].set_color(LINE)
    return made


def _ticks(axes: Axes, wanted: Sequence[float]) -> None:
    """Put ticks on a logarithmic axis where it shows one of the wanted values."""
    low, high = axes.get_ylim()
    inside = [value for value in wanted if low <= value <= high]
    axes.set_yticks(inside, [f"{value:g}" for value in inside])
    axes.yaxis.set_minor_locator(NullLocator())
