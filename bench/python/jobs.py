"""What is timed: every job with its error, so that speed can't be bought with quality.

A job is a function of a shape, azimuth lines and range gates, and of the number of threads; it makes its data and returns a call. Images
have azimuth contiguous (Fortran order) unless the name says otherwise.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

import sarfocus
from sarfocus.experiments import strips, xie2023, zhou2022

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "peers"))
import backprojection_job
from fftw import RoundTrip

Complex = NDArray[np.complex64]
Floats = NDArray[np.float64]
Shape = tuple[int, int]
SEED = 1
STANDOFF = 5000.0  # m, of backprojection
SPEED_OF_LIGHT = 299_792_458.0  # m/s
YARDSTICK = "fftw"


@dataclass(frozen=True)
class Job:
    """A call to be timed, what its result is worth, and what has to be put right after every call."""

    call: Callable[[], Any]
    error: Callable[[Any], float]
    unit: str = "dB"
    restore: Callable[[], None] = lambda: None


def relative_db(value: NDArray[Any], truth: NDArray[Any]) -> float:
    return float(20.0 * np.log10(np.linalg.norm(value - truth) / np.linalg.norm(truth)))


def held(like: Complex) -> Complex:
    """An array for the result whose memory has been touched, so that it is not counted as taken by the call."""
    return np.full_like(like, 1.0)


def without_line(phase: Floats) -> Floats:
    k = np.linspace(-1.0, 1.0, len(phase))
    return np.asarray(phase - np.polyval(np.polyfit(k, phase, 1), k))


def fftw(shape: Shape, threads: int) -> Job:
    trip = RoundTrip(shape[1], shape[0], threads)
    return Job(trip, lambda _: trip.error_db(), restore=trip.restore)


def noise(shape: Shape) -> Complex:
    rng = np.random.default_rng(SEED)
    out = np.empty(shape, np.complex64)
    for line in out:
        line[:] = rng.standard_normal(2 * shape[1], dtype=np.float32).view(np.complex64)
    return out


def compression(shape: Shape, threads: int, *, contiguous: bool, back: bool) -> Job:
    """Compression of noise, or the inverse; the error is that of a gate against the equation in double precision."""
    image = noise(shape[::-1]).T if contiguous else noise(shape)
    out = held(image)
    geometry = strips.airborne(shape[1], 16_000.0, 0.5)
    call = sarfocus.azimuth_decompress if back else sarfocus.azimuth_compress
    f = np.fft.fftfreq(shape[0], 1.0 / strips.PRF)
    gate = shape[1] // 3
    turn = np.exp((1j if back else -1j) * np.pi * f**2 / geometry.fm_rate(gate))
    truth = np.fft.ifft(np.fft.fft(image[:, gate].astype(np.complex128)) * turn)
    return Job(lambda: call(image, geometry, out=out, threads=threads), lambda made: relative_db(made[:, gate], truth))


def speckle_with_points(shape: Shape) -> tuple[Complex, Floats]:
    """Speckle, a point of 30 dB in every fourth gate, and the smooth phase error of 4.9 rad RMS under which both are."""
    rows, columns = shape
    rng = np.random.default_rng(SEED)
    image = noise((columns, rows)).T
    image *= np.float32(np.sqrt(0.5))
    gates = np.arange(0, columns, 4)
    places = rng.integers(rows // 8, 7 * rows // 8, len(gates))
    image[places, gates] += (10**1.5 * np.exp(2j * np.pi * rng.random(len(gates)))).astype(np.complex64)
    angle = 0.5 * np.pi * (np.linspace(-1.0, 1.0, rows) + 1.0)
    phase = without_line(np.cos(np.outer(angle, np.arange(2, 9))) @ rng.standard_normal(7))
    phase *= 4.9 / phase.std()
    turn = np.exp(1j * np.fft.ifftshift(phase)).astype(np.complex64)
    for gate in image.T:
        gate[:] = scipy.fft.ifft(scipy.fft.fft(gate) * turn)
    return image, phase


def spotlight(shape: Shape, threads: int, method: str, **options: Any) -> Job:
    """Autofocus of a spotlight image, whole call; the error is what is left of the phase."""
    image, phase = speckle_with_points(shape)
    out = held(image)
    focus = getattr(sarfocus, method)
    return Job(
        lambda: focus(image, out=out, threads=threads, **options),
        lambda made: float(without_line(np.asarray(made.phase_error) - phase).std()),
        "rad",
    )


def strip_with_points(shape: Shape, threads: int) -> tuple[Complex, sarfocus.StripmapGeometry, Floats]:
    """Clutter, forty points 25 dB above it, and the piecewise linear error under which both are; the apertures shrink with the strip."""
    rows, columns = shape
    rng = np.random.default_rng(SEED)
    near = xie2023.RANGE_START * rows / xie2023.N
    geometry = strips.airborne(columns, near, 0.25 * near / columns)
    slopes = [strips.slope_of_shift(geometry, shift, columns // 2) for shift in xie2023.SHIFTS]
    phase = strips.piecewise_linear(rows, rows * np.arange(1, len(slopes)) / len(slopes), slopes)
    places = np.c_[(np.arange(40) + rng.uniform(0.1, 0.9, 40)) * rows / 40, rng.integers(columns, size=40)]
    strength = 10.0**1.25 * np.exp(2j * np.pi * rng.random(40))
    effects: dict[str, Any] = {"clutter_power": 1.0, "phase_error": phase, "seed": SEED}
    raw = sarfocus.simulate.stripmap(geometry, places, strength, n_azimuth=rows, threads=threads, **effects)
    return np.asfortranarray(sarfocus.azimuth_compress(raw, geometry, threads=threads)), geometry, phase


def strip(shape: Shape, threads: int, method: str, **options: Any) -> Job:
    """Autofocus of a strip of clutter and points, whole call; the error is what is left of the phase where there are points."""
    image, geometry, phase = strip_with_points(shape, threads)
    out = held(image)
    focus = getattr(sarfocus, method)
    inside = slice(shape[0] // 8, 7 * shape[0] // 8)
    return Job(
        lambda: focus(image, geometry, out=out, threads=threads, **options),
        lambda made: float(without_line((np.asarray(made.phase_error) - phase)[inside]).std()),
        "rad",
    )


def backprojection(shape: Shape, threads: int, method: str, *, over: str = "plane", **options: Any) -> Job:
    """As many pulses as azimuth lines; the error is that of random pixels against the sum in double precision."""
    with tempfile.TemporaryDirectory() as folder:
        backprojection_job.write(Path(folder), shape, STANDOFF)
        job = backprojection_job.read(Path(folder))
    grid = backprojection_job.grid(job, over)
    out = held(np.empty(shape, np.complex64))
    how = backprojection_job.options(job) | {"method": method, "out": out, "threads": threads} | options
    lines, gates = job["pixels"].T
    return Job(
        lambda: sarfocus.backproject(job["data"], job["positions"], grid, **how),
        lambda made: relative_db(made[lines, gates], job[f"truth_{over}"]),
    )


def phase_history(shape: Shape, threads: int) -> Job:
    """Autofocus by backprojection of the job of backprojection with points in it: the error is what is left of the phase."""
    rows, columns = shape
    rng = np.random.default_rng(SEED)
    with tempfile.TemporaryDirectory() as folder:
        backprojection_job.write(Path(folder), shape, STANDOFF)
        job = backprojection_job.read(Path(folder))
    grid = backprojection_job.grid(job, "plane")
    places = np.c_[rng.integers(rows // 8, 7 * rows // 8, 200), rng.integers(columns // 8, 7 * columns // 8, 200)]
    targets = np.array([grid.position(*place) for place in places])
    how = backprojection_job.options(job)
    data = sarfocus.simulate.points(
        job["positions"],
        targets,
        30.0 * np.exp(2j * np.pi * rng.random(200)),
        n_range=job["data"].shape[1],
        bandwidth=backprojection_job.BANDWIDTH,
        noise_power=1.0,
        seed=SEED,
        threads=threads,
        **how,
    )
    angle = 0.5 * np.pi * (np.linspace(-1.0, 1.0, rows) + 1.0)
    phase = without_line(np.cos(np.outer(angle, np.arange(2, 9))) @ rng.standard_normal(7))
    data *= np.exp(1j * phase / phase.std())[:, None].astype(np.complex64)
    out = held(np.empty(shape, np.complex64))
    return Job(
        lambda: sarfocus.gpga(data, job["positions"], grid, out=out, threads=threads, do_no_harm=False, **how),
        lambda made: float(without_line(np.asarray(made.phase_error) - phase / phase.std()).std()),
        "rad",
    )


def multichannel(shape: Shape, threads: int, how: str) -> Job:
    """Pixels about a point at 50 km seen by four channels, by folded reconstruction and by plain backprojection of the same samples.

    The error is that against the reconstruction over sub-images, of a part; plain backprojection has the ambiguities that it leaves.
    """
    motion = zhou2022.height_error(SEED)
    echo = zhou2022.simulated(zhou2022.GROUND_RANGES[:1], motion, threads)
    chip, part = (zhou2022.chip(zhou2022.GROUND_RANGES[0], 0.0, extent) for extent in (shape, (64, 64)))

    def form(grid: sarfocus.ImageGrid, way: str) -> Complex:
        if way == "plain":
            return zhou2022.plain(echo, grid, motion, threads)
        band = {"doppler_bandwidth": zhou2022.DOPPLER_BANDWIDTH, "reconstruction": way}
        return np.asarray(sarfocus.hrws.reconstruct(echo, grid, motion, threads=threads, **band))

    return Job(lambda: form(chip, how), lambda _: relative_db(form(part, how), form(part, "sub_image")))


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


def range_doppler(shape: Shape, threads: int) -> Job:
    """Two points; the error is that of the gate of one against the exact spectrum."""
    rows, columns = shape
    sampling, range_start, near = 180e6, 4000.0, 300
    collection = {"wavelength": 0.031, "prf": 640.0, "velocity": 120.0, "doppler_bandwidth": 500.0}
    ranges = range_start + SPEED_OF_LIGHT / (2.0 * sampling) * np.arange(columns)
    geometry = sarfocus.StripmapGeometry(**collection, slant_range=ranges)
    gate = columns // 2
    targets = [(0.5 * rows, gate - 0.6), (0.49 * rows, gate + 2.7)]
    echo = sarfocus.simulate.stripmap_echo(geometry, targets, [1, 1j], n_azimuth=rows, range_bandwidth=150e6, window="hamming")
    first = max(gate - near, 0)
    truth = exact_gate(echo[:, first : gate + near].astype(np.complex128), collection, sampling, ranges[first], ranges[gate])
    out = held(echo)
    return Job(
        lambda: sarfocus.form_stripmap(echo, geometry, range_start=range_start, range_sampling=sampling, out=out, threads=threads),
        lambda made: relative_db(made[:, gate], truth),
    )


JOBS: dict[str, Callable[[Shape, int], Job]] = {
    YARDSTICK: fftw,
    "azimuth_compress": partial(compression, contiguous=True, back=False),
    "azimuth_decompress": partial(compression, contiguous=True, back=True),
    "azimuth_compress strided": partial(compression, contiguous=False, back=False),
    "azimuth_decompress strided": partial(compression, contiguous=False, back=True),
    "form_stripmap": range_doppler,
    **{name: partial(spotlight, method=name) for name in sarfocus.method_names(strip=False)},
    "auto": partial(spotlight, method="autofocus"),
    **{f"strip {name}": partial(strip, method=name) for name in sarfocus.method_names(strip=True)},
    "strip auto": partial(strip, method="autofocus"),
    "strip spga, 1 pass": partial(strip, method="spga", iterations=1, do_no_harm=False),
    "strip spga_linear, unjudged": partial(strip, method="spga_linear", do_no_harm=False),
    "backproject exact": partial(backprojection, method="exact"),
    "backproject ffbp": partial(backprojection, method="ffbp"),
    "backproject points": partial(backprojection, method="exact", over="points"),
    "gpga": phase_history,
    "hrws plain": partial(multichannel, how="plain"),
    "hrws folded": partial(multichannel, how="folded"),
}


def shape_of(text: str) -> Shape:
    """`2048` or `8192x512`: azimuth lines x range gates."""
    rows, _, columns = text.partition("x")
    return int(rows), int(columns or rows)


def own_shape(name: str) -> Shape:
    """Of a job for which nobody chose one."""
    if name.startswith("hrws"):
        return 256, 256
    size = 1024 if name.startswith(("backproject", "gpga")) else 2048
    return size, size
