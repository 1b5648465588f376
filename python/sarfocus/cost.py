"""What a call costs in time and memory, from sizes alone, before it is made.

Time is counted in what the machine at hand does in a moment: transforms there and back along azimuth, and pixels times pulses of
exact backprojection. What autofocus takes depends on the scene too: these are the figures of clutter with many strong points, judged and
corrected. ``bench/python/cost_model.py`` fits and checks them.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import ImageGrid, StripmapGeometry, azimuth_compress, backproject, plan_factorized
from .io import Image, PhaseHistory
from .memory import SAMPLE_BYTES

GATES = 512  # at most so many range gates does an estimate look at
REPEATS = 5


@dataclass(frozen=True)
class Cost:
    """Time, s, and memory beyond input and output, bytes."""

    seconds: float
    memory: int


@dataclass(frozen=True)
class Machine:
    """How long this machine takes, all threads together."""

    transform: float  # s, there and back, for a sample and each doubling of the length of its line
    pixel_pulse: float  # s


@dataclass(frozen=True)
class Method:
    """Work in transforms there and back, and memory in images: what grows with the whole image, and what with the gates looked at."""

    image: float
    gates: float
    image_memory: float
    gates_memory: float

    def cost(self, shape: tuple[int, int], machine: Machine) -> Cost:
        """Shape: azimuth lines and range gates."""
        n_azimuth, n_range = shape
        looked_at = min(n_range, GATES)
        samples = n_azimuth * (self.image * n_range + self.gates * looked_at)
        memory = n_azimuth * (self.image_memory * n_range + self.gates_memory * looked_at) * SAMPLE_BYTES
        return Cost(samples * doublings(n_azimuth) * machine.transform, round(memory))


SPOTLIGHT = {}
STRIP = {}
