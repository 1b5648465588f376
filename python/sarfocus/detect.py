"""Strong points and range gates: CFAR, local maxima, selection."""

from ._core.detect import (
    cell_averaging_factor,
    cfar_1d,
    cfar_1d_at,
    cfar_2d,
    cfar_2d_at,
    coalesce,
    contrast,
    filter_contrast,
    greatest_of_factor,
    local_maxima,
    ordered_statistic_factor,
    point_dtype,
    point_limit,
    spread_evenly,
    strongest_gates,
    strongest_samples,
)

__all__ = [
    "cell_averaging_factor",
    "cfar_1d",
    "cfar_1d_at",
    "cfar_2d",
    "cfar_2d_at",
    "coalesce",
    "contrast",
    "filter_contrast",
    "greatest_of_factor",
    "local_maxima",
    "ordered_statistic_factor",
    "point_dtype",
    "point_limit",
    "spread_evenly",
    "strongest_gates",
    "strongest_samples",
]
