"""Multichannel strips of high resolution and wide swath: echoes, motion compensation, and images free of azimuth ambiguities."""

from ._core.hrws import (
    ChannelWeights,
    Echo,
    PhaseCompensation,
    Sampling,
    SiMecResult,
    SiMecStatus,
    bp_fmsa,
    channel_weights,
    pga,
    reconstruct,
    sampling,
    si_mec,
)
from .strong_points import strong_regions

__all__ = [
    "ChannelWeights",
    "Echo",
    "PhaseCompensation",
    "Sampling",
    "SiMecResult",
    "SiMecStatus",
    "bp_fmsa",
    "channel_weights",
    "pga",
    "reconstruct",
    "sampling",
    "si_mec",
    "strong_regions",
]
