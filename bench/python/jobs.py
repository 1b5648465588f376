"""What is timed: every job with its error, so that speed can't be bought with quality.

A job is a function of a size and of the number of threads that makes its data and returns a call. Most images are `size` x `size`; with
azimuth contiguous (Fortran order) unless the name says otherwise.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

import sarfocus
from sarfocus.experiments import strips, xie2023, xie2023_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "peers"))
import backprojection_job
from fftw import RoundTrip

Complex = NDArray[np.complex64]
Floats = NDArray[np.float64]
SEED = 1
SPEED_OF_LIGHT = 299_792_458.0  # m/s
YARDSTICK = "fftw"


@dataclass(frozen=True)
class Job:
    """A call to be timed, what its result is worth, and what has to be put right after every call."""

    call: Callable[[], Any]
    error: Callable[[Any], str]
    restore: Callable[[], None] = lambda: None


def relative_db(value: NDArray[Any], truth: NDArray[Any]) -> str:
    return f"{20.0 * np.log10(np.linalg.norm(value - truth) / np.linalg.norm(truth)):.1f} dB"


def without_line(phase: Floats) -> Floats:
    k = np.linspace(-1.0, 1.0, len(phase))
    return np.asarray(phase - np.polyval(np.polyfit(k, phase, 1), k))


def fftw(size: int, threads: int) -> Job:
    trip = RoundTrip(size, size, threads)
    return Job(trip, lambda _: f"{trip.error_db():.1f} dB", trip.restore)


def noise(size: int) -> Complex:
    rng = np.random.default_rng(SEED)
    out = np.empty((size, size), np.complex64)
    for line in out:
        line[:] = rng.standard_normal(2 * size, dtype=np.float32).view(np.complex64)
    return out


def compression(size: int, threads: int, *, contiguous: bool, back: bool) -> Job:
    """Compression of noise, or the inverse; the error is that of a gate against the equation in double precision."""
    image = noise(size).T if contiguous else noise(size)
    out = np.zeros_like(image)
    geometry = strips.airborne(size, 16_000.0, 0.5)
    call = sarfocus.azimuth_decompress if back else sarfocus.azimuth_compress
    f = np.fft.fftfreq(size, 1.0 / strips.PRF)
    gate = size // 3
    turn = np.exp((1j if back else -1j) * np.pi * f**2 / geometry.fm_rate(gate))
    truth = np.fft.ifft(np.fft.fft(image[:, gate].astype(np.complex128)) * turn)
    return Job(lambda: call(image, geometry, out=out, threads=threads), lambda made: relative_db(made[:, gate], truth))


def speckle_with_points(size: int) -> tuple[Complex, Floats]:
    """Speckle, a point of 30 dB in every fourth gate, and the smooth phase error of 4.9 rad RMS under which both are."""
    rng = np.random.default_rng(SEED)
    image = noise(size).T
    image *= np.float32(np.sqrt(0.5))
    gates = np.arange(0, size, 4)
    rows = rng.integers(size // 8, 7 * size // 8, len(gates))
    image[rows, gates] += (10**1.5 * np.exp(2j * np.pi * rng.random(len(gates)))).astype(np.complex64)
    angle = 0.5 * np.pi * (np.linspace(-1.0, 1.0, size) + 1.0)
    phase = without_line(np.cos(np.outer(angle, np.arange(2, 9))) @ rng.standard_normal(7))
    phase *= 4.9 / phase.std()
    turn = np.exp(1j * np.fft.ifftshift(phase)).astype(np.complex64)
    for gate in image.T:
        gate[:] = scipy.fft.ifft(scipy.fft.fft(gate) * turn)
    return image, phase


def gradient(size: int, threads: int, method: str) -> Job:
    """Autofocus of a spotlight image, whole call; the error is what is left of the phase."""
    image, phase = speckle_with_points(size)
    out = np.zeros_like(image)
    focus = getattr(sarfocus, method)
    return Job(
        lambda: focus(image, out=out, threads=threads),
        lambda made: f"{without_line(np.asarray(made.phase_error) - phase).std():.4f} rad",
    )


def strip(size: int, threads: int, method: str, **options: Any) -> Job:
    """Autofocus of a strip of clutter and points, whole call; the error is what is left of the phase where there are points."""
    rng = np.random.default_rng(SEED)
    scene = xie2023.make_scene(xie2023.table_geometry(size), xie2023.SHIFTS, rng, threads=threads)
    image = np.asfortranarray(xie2023_time.clutter_and_points(scene, rng, threads))
    out = np.zeros_like(image)
    focus = getattr(sarfocus, method)
    inside = slice(size // 8, 7 * size // 8)
    return Job(
        lambda: focus(image, scene.geometry, out=out, threads=threads, **options),
        lambda made: f"{without_line((np.asarray(made.phase_error) - scene.phase_error)[inside]).std():.4f} rad",
    )


def backprojection(size: int, threads: int, method: str, **options: Any) -> Job:
    """`size` pulses; the error is that of random pixels against the sum in double precision."""
    with tempfile.TemporaryDirectory() as folder:
        backprojection_job.write(Path(folder), size)
        with np.load(Path(folder) / "job.npz") as stored:
            held = dict(stored)
    pixel = float(held["pixel"])
    corner = -pixel * (size // 2)
    grid = sarfocus.ImageGrid.plane((corner, corner, 0.0), (pixel, 0.0, 0.0), (0.0, pixel, 0.0), (size, size))
    out = np.zeros((size, size), np.complex64)
    how: dict[str, Any] = {
        "range_start": held["start"],
        "range_spacing": float(held["spacing"]),
        "wavelength": float(held["wavelength"]),
        "method": method,
        "out": out,
        "threads": threads,
    }
    rows, columns = held["pixels"].T
    return Job(
        lambda: sarfocus.backproject(held["data"], held["positions"], grid, **how, **options),
        lambda made: relative_db(made[rows, columns], held["truth"]),
    )


def exact_gate(echo: NDArray[np.complex128], geometry: dict[str, float], sampling: float, range_start: float, closest: float) -> Any:
    """Sum over the exact two-dimensional spectrum in double precision, one range gate, no squint."""
    n_pulse, n_fast_time = echo.shape
    carrier = SPEED_OF_LIGHT / geometry["wavelength"]
    f = np.fft.fftfreq(n_pulse, 1.0 / geometry["prf"])
    fr = np.fft.fftfreq(n_fast_time + 64, 1.0 / sampling)
    line = np.zeros(n_pulse, np.complex128)
    spectrum = np.fft.fft(echo, axis=0)
    half = geometry["doppler_bandwidth"] / 2.0
    for k in np.flatnonzero((f >= -half) & (f < half)):
        root = np.sqrt((carrier + fr) ** 2 - (SPEED_OF_LIGHT * f[k] / (2.0 * geometry["velocity"])) ** 2)
        cycles = (2.0 * closest * (root - carrier) - 2.0 * fr * range_start) / SPEED_OF_LIGHT
        line[k] = np.exp(2j * np.pi * cycles) @ np.fft.fft(spectrum[k], len(fr)) / len(fr)
    return np.fft.ifft(line)


def range_doppler(size: int, threads: int) -> Job:
    """Two points; the error is that of the gate of one against the exact spectrum."""
    sampling, range_start, near = 180e6, 4000.0, 300
    collection = {"wavelength": 0.031, "prf": 640.0, "velocity": 120.0, "doppler_bandwidth": 500.0}
    ranges = range_start + SPEED_OF_LIGHT / (2.0 * sampling) * np.arange(size)
    geometry = sarfocus.StripmapGeometry(**collection, slant_range=ranges)
    gate = size // 2
    targets = [(0.5 * size, gate - 0.6), (0.49 * size, gate + 2.7)]
    echo = sarfocus.simulate.stripmap_echo(geometry, targets, [1, 1j], n_azimuth=size, range_bandwidth=150e6, window="hamming")
    first = max(gate - near, 0)
    truth = exact_gate(echo[:, first : gate + near].astype(np.complex128), collection, sampling, ranges[first], ranges[gate])
    out = np.zeros_like(echo)
    return Job(
        lambda: sarfocus.form_stripmap(echo, geometry, range_start=range_start, range_sampling=sampling, out=out, threads=threads),
        lambda made: relative_db(made[:, gate], truth),
    )


JOBS: dict[str, Callable[[int, int], Job]] = {
    YARDSTICK: fftw,
    "azimuth_compress": lambda n, threads: compression(n, threads, contiguous=True, back=False),
    "azimuth_decompress": lambda n, threads: compression(n, threads, contiguous=True, back=True),
    "azimuth_compress strided": lambda n, threads: compression(n, threads, contiguous=False, back=False),
    "azimuth_decompress strided": lambda n, threads: compression(n, threads, contiguous=False, back=True),
    "form_stripmap": range_doppler,
    "pga": lambda n, threads: gradient(n, threads, "pga"),
    "conventional_pga": lambda n, threads: gradient(n, threads, "conventional_pga"),
    "adaptive_pga": lambda n, threads: gradient(n, threads, "adaptive_pga"),
    "spga, 1 pass": lambda n, threads: strip(n, threads, "spga", iterations=1, do_no_harm=False),
    "spga_linear": lambda n, threads: strip(n, threads, "spga_linear", do_no_harm=False),
    "backproject exact": lambda n, threads: backprojection(n, threads, "exact"),
    "backproject ffbp": lambda n, threads: backprojection(n, threads, "ffbp"),
}
DEFAULT_SIZE = {name: 1024 if name.startswith("backproject") else 2048 for name in JOBS}
