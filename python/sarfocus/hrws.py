"""Multichannel strips of high resolution and wide swath: echoes, motion compensation, and images free of azimuth ambiguities."""

import numpy as np
import numpy.typing as npt

from ._core import ShapeError
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
    "moved",
    "pga",
    "reconstruct",
    "sampling",
    "si_mec",
    "strong_regions",
]


def moved(echo: Echo, motion: npt.ArrayLike) -> Echo:
    """Return the same samples, the phase centres of every channel moved by a motion: to estimate again what an estimate has left.

    Parameters
    ----------
    echo : Echo
    motion : float64 [n_pulse, 3]
        m, as `si_mec` returns it.

    Returns
    -------
    Echo
        Shares the samples with `echo`.

    Raises
    ------
    ShapeError, NumericalError
        A motion for another number of pulses, or one that is not finite.
    """
    centres = np.asarray(echo.phase_centres)
    shift = np.asarray(motion, dtype=np.float64)
    if shift.shape != centres.shape[1:]:
        raise ShapeError(f"motion: expected shape {centres.shape[1:]}, got {shift.shape}")
    place = (centres + shift, echo.range_start, echo.range_spacing)
    return Echo(echo.data, *place, echo.wavelength, echo.prf, echo.velocity, echo.baselines)
