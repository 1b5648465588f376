"""The steps of stripmap autofocus, one by one; `sarfocus.spga_linear` runs them one after the other."""

from ._core.strip import (
    Apertures,
    Stitching,
    StripPhase,
    azimuth_correct,
    extract,
    integrate_gradient,
    match_search,
    match_slope,
    point_dtype,
    refine,
    seam_dtype,
    search_matrix,
    select_points,
    stitch,
)

__all__ = [
    "Apertures",
    "Stitching",
    "StripPhase",
    "azimuth_correct",
    "extract",
    "integrate_gradient",
    "match_search",
    "match_slope",
    "point_dtype",
    "refine",
    "seam_dtype",
    "search_matrix",
    "select_points",
    "stitch",
]
