"""Estimates made before anything is allocated."""

from __future__ import annotations

from collections.abc import Sequence

from . import MemoryEstimateError
from ._core import available_memory

SAMPLE_BYTES = 8  # complex64
GIB = 1 << 30


def require_image_memory(shape: Sequence[int], copies: int = 1) -> None:
    """Raise MemoryEstimateError, saying how much, where `copies` images of `shape` don't fit into the memory that is free now."""
    needed = int(shape[0]) * int(shape[1]) * SAMPLE_BYTES * copies
    free = available_memory()
    if free and needed > free:
        raise MemoryEstimateError(
            f"{shape[0]} x {shape[1]} pixels need {needed / GIB:.1f} GiB, {free / GIB:.1f} GiB are free: "
            "make the image smaller or the pixels larger"
        )
