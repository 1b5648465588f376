"""The yardstick of every other time: transforms there and back by FFTW itself, in place, lines contiguous, planned by measurement."""

from __future__ import annotations

import ctypes
from ctypes.util import find_library
from typing import Any

import numpy as np

FORWARD, BACKWARD, MEASURE = -1, 1, 0


class RoundTrip:
    """In-place transforms of all lines of an array of its own, and back; plans are made beforehand."""

    def __init__(self, lines: int, length: int, threads: int) -> None:
        parallel = library("fftw3f_omp")
        self.library = library("fftw3f")
        parallel.fftwf_init_threads()
        parallel.fftwf_plan_with_nthreads(threads)
        self.library.fftwf_plan_many_dft.restype = ctypes.c_void_p
        self.data = np.zeros((lines, length), np.complex64)
        self.length = length
        self.plans = [self.plan(sign) for sign in (FORWARD, BACKWARD)]
        rng = np.random.default_rng(1)
        for line in self.data:
            line[:] = rng.standard_normal(2 * length, dtype=np.float32).view(np.complex64)
        self.first = self.data[0].copy()

    def plan(self, sign: int) -> ctypes.c_void_p:
        lines, length = self.data.shape
        at = ctypes.c_void_p(self.data.ctypes.data)
        made = self.library.fftwf_plan_many_dft(
            1, (ctypes.c_int * 1)(length), lines, at, None, 1, length, at, None, 1, length, ctypes.c_int(sign), ctypes.c_uint(MEASURE)
        )
        if not made:
            raise RuntimeError("FFTW made no plan")
        return ctypes.c_void_p(made)

    def __call__(self) -> np.ndarray:
        for plan in self.plans:
            self.library.fftwf_execute(plan)
        return self.data

    def restore(self) -> None:
        """Divide by the length, as the transforms don't."""
        self.data *= np.float32(1.0 / self.length)

    def error_db(self) -> float:
        return float(20.0 * np.log10(np.linalg.norm(self.data[0] - self.first) / np.linalg.norm(self.first)))


def library(name: str) -> Any:
    """Load a shared library of the system."""
    found = find_library(name)
    if found is None:
        raise RuntimeError(f"lib{name} is missing: ./dev bench installs it")
    return ctypes.CDLL(found, mode=ctypes.RTLD_GLOBAL)
