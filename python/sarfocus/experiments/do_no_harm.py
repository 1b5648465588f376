"""Does any autofocus make a random scene worse than it was, with a phase error or without one.

Judged by the truth. With an error an image is worse where its entropy rises by more than 1e-6 of itself, or the peaks of the true points
that stand still fall by more than 0.1 dB on average. Without one, every change counts, with both figures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import StripmapGeometry, autofocus, azimuth_compress, method_names, quality, simulate
from .crlb import smooth_phase, without_line
from .model import Reproduction, at_most
from .strips import ComplexArray, FloatArray, airborne, piecewise_linear

SCENES = 500
SEED = 20260722
KINDS = ("clutter", "one point", "few points", "many points", "saturated", "sea", "ships", "ships and points")
STRIP_SHARE = 0.2  # of the scenes
STRIP_AZIMUTH, STRIP_RANGE, STRIP_START = 1024, 64, 3000.0  # m
SMALLEST, LARGEST = (96, 64), (256, 192)  # of a spotlight image
SMALLEST_ERROR, LARGEST_ERROR = 0.5, 8.0  # rad, peak
ENTROPY_RISE = 1e-6  # relative
PEAK_FALL_DB = 0.1
UPSAMPLE, SEARCH = 8, 24  # of the peaks of true points; azimuth pixels: an error may displace them
Progress = Callable[[str, int, int], None] | None


@dataclass
class Scene:
    """An image whose truth is known."""

    kind: str
    geometry: StripmapGeometry | None
    image: ComplexArray
    points: list[tuple[float, int]]  # azimuth in pixels, range gate, of what stands still
    error: bool


@dataclass
class Outcome:
    """What a method made of a scene."""

    verdict: str  # unchanged, improved, worse
    entropy_change: float  # relative
    peak_change_db: float  # mean over the true points; nan where there are none
    error: bool


def run(*, scenes: int = SCENES, seed: int = SEED, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Run ``autofocus`` and every single method on random scenes, each without and with a phase error."""
    found: dict[tuple[str, str], list[Outcome]] = {}
    for number in range(scenes):
        for error in (False, True):
            scene = make(seed, number, error, threads)
            methods = ["auto", *method_names(strip=scene.geometry is not None)]
            for method in methods:
                name = scene.kind if scene.geometry is None else f"strip, {scene.kind}"
                found.setdefault((name, method), []).append(focus(scene, method, threads))
        if progress is not None:
            progress("do-no-harm", number + 1, scenes)
    rows = [row(case, method, outcomes) for (case, method), outcomes in sorted(found.items(), key=order)]
    parameters = {
        "scenes": scenes, "seed": seed, "strip_share": STRIP_SHARE, "spotlight_shapes": [list(SMALLEST), list(LARGEST)],
        "strip_shape": [STRIP_AZIMUTH, STRIP_RANGE], "error_peak": [SMALLEST_ERROR, LARGEST_ERROR],
        "worse": f"entropy up by {ENTROPY_RISE:g} of itself, or peaks of true points down by {PEAK_FALL_DB:g} dB on average",
    }  # fmt: skip
    return Reproduction(name="do-no-harm", parameters=parameters, rows=rows, required=required(found))


def order(item: tuple[tuple[str, str], list[Outcome]]) -> tuple[bool, int, str]:
    """Spotlight before strips, in the order of the kinds; auto first."""
    case, method = item[0]
    return case.startswith("strip"), KINDS.index(case.removeprefix("strip, ")), "" if method == "auto" else method


def required(found: dict[tuple[str, str], list[Outcome]]) -> list[Any]:
    """No image worse, with or without an error: of auto, and of every method by itself."""
    out = []
    for method in sorted({name for _, name in found}, key=lambda name: (name != "auto", name)):
        for error in (False, True):
            mine = [o for (_, name), outcomes in found.items() if name == method for o in outcomes if o.error is error]
            worse = sum(o.verdict == "worse" for o in mine)
            out.append(at_most(f"{method}: images made worse, of {len(mine)} {'with' if error else 'without'} an error", worse, 0))
    return out


def row(case: str, method: str, outcomes: list[Outcome]) -> dict[str, Any]:
    """Count the verdicts of a method on one kind of scene."""
    out: dict[str, Any] = {"method": method, "case": case}
    for error, label in ((False, "no_error"), (True, "error")):
        mine = [o for o in outcomes if o.error is error]
        for verdict in ("unchanged", "improved", "worse"):
            out[f"{label}_{verdict}"] = sum(o.verdict == verdict for o in mine)
    changed = [o for o in outcomes if o.verdict != "unchanged"]
    peaks = [o.peak_change_db for o in changed if np.isfinite(o.peak_change_db)]
    out["worst_entropy_change"] = max((o.entropy_change for o in changed), default=0.0)
    out["worst_peak_change_db"] = min(peaks, default=0.0)
    return out


def make(seed: int, number: int, error: bool, threads: int = 0) -> Scene:
    """Simulate scene `number`; with and without the error it is the same but for the error."""
    generator = np.random.default_rng([seed, number])
    kind = KINDS[number % len(KINDS)]
    if generator.random() < STRIP_SHARE:
        return strip_scene(kind, error, generator, threads)
    return spotlight_scene(kind, error, generator)


def point_count(kind: str, generator: np.random.Generator) -> int:
    """How many points stand still."""
    ranges = {
        "one point": (1, 1),
        "few points": (2, 7),
        "many points": (20, 60),
        "saturated": (5, 30),
        "sea": (0, 3),
        "ships and points": (3, 12),
    }
    low, high = ranges.get(kind, (0, 0))
    return int(generator.integers(low, high + 1))


def spotlight_scene(kind: str, error: bool, generator: np.random.Generator) -> Scene:
    """Points at fractional azimuth pixels in speckle; the error is on the azimuth spectrum."""
    n, m = (int(generator.integers(low, high + 1)) for low, high in zip(SMALLEST, LARGEST, strict=True))
    image = texture(kind, (n, m), generator) * noise((n, m), generator)
    spectrum = np.fft.fft(image, axis=0)
    frequency = np.fft.fftfreq(n)
    points = []
    for _ in range(point_count(kind, generator)):
        place, gate = float(generator.uniform(0.05 * n, 0.95 * n)), int(generator.integers(m))
        spectrum[:, gate] += amplitude(generator) * np.exp(-2j * np.pi * frequency * place)
        points.append((place, gate))
    if kind.startswith("ships"):
        for _ in range(int(generator.integers(1, 5))):
            own = generator.uniform(-12.0, 12.0) * (2.0 * frequency) ** 2  # rad: a ship accelerates along the line of sight
            place, gate = float(generator.uniform(0.05 * n, 0.95 * n)), int(generator.integers(m))
            spectrum[:, gate] += amplitude(generator) * np.exp(1j * (own - 2.0 * np.pi * frequency * place))
    spectrum[n // 2] = 0  # a broken shift of the Nyquist component has no single value
    phase = phase_error(n, generator, strip=False)
    if error:
        spectrum *= np.exp(1j * np.fft.ifftshift(phase))[:, None]
    if kind == "saturated":
        spectrum = clipped(spectrum, generator)
    return Scene(kind, None, np.fft.ifft(spectrum, axis=0).astype(np.complex64), points, error)


def strip_scene(kind: str, error: bool, generator: np.random.Generator, threads: int) -> Scene:
    """Points over several apertures of a strip; the error is over slow time."""
    geometry = airborne(STRIP_RANGE, STRIP_START, 0.5)
    count = point_count(kind, generator)
    if kind == "few points":
        count += 6  # over three apertures
    points = [(float(generator.uniform(0.03, 0.97) * STRIP_AZIMUTH), int(generator.integers(STRIP_RANGE))) for _ in range(count)]
    strength = np.array([amplitude(generator) for _ in points], dtype=np.complex128)
    seed = int(generator.integers(2**32))
    pixels = np.array(points, dtype=np.float64).reshape(-1, 2)
    power = 0.0 if kind == "sea" else 1.0
    raw = simulate.stripmap(geometry, pixels, strength, n_azimuth=STRIP_AZIMUTH, clutter_power=power, seed=seed, threads=threads)
    if kind == "sea":
        empty = np.zeros((0, 2)), np.zeros(0, np.complex128)
        clutter = simulate.stripmap(geometry, *empty, n_azimuth=STRIP_AZIMUTH, clutter_power=1.0, seed=seed, threads=threads)
        uneven = azimuth_compress(clutter, geometry, threads=threads) * texture(kind, clutter.shape, generator).astype(np.float32)
        raw = raw + decompressed(uneven, geometry, threads)
    if kind.startswith("ships"):
        raw = raw + sum(ship(geometry, generator, threads) for _ in range(int(generator.integers(1, 5))))
    phase = phase_error(STRIP_AZIMUTH, generator, strip=True)
    if error:
        raw = raw * np.exp(1j * phase)[:, None]
    if kind == "saturated":
        raw = clipped(raw, generator)
    return Scene(kind, geometry, azimuth_compress(np.ascontiguousarray(raw, np.complex64), geometry, threads=threads), points, error)


def ship(geometry: StripmapGeometry, generator: np.random.Generator, threads: int) -> ComplexArray:
    """Raw signal of a ship: over its aperture a phase of its own, from its acceleration."""
    place = np.array([[generator.uniform(0.05, 0.95) * STRIP_AZIMUTH, generator.integers(STRIP_RANGE)]])
    raw = simulate.stripmap(geometry, place, np.array([amplitude(generator)]), n_azimuth=STRIP_AZIMUTH, threads=threads)
    half = 0.5 * geometry.aperture_samples(STRIP_RANGE // 2)
    own = generator.uniform(-12.0, 12.0) * ((np.arange(STRIP_AZIMUTH) - place[0, 0]) / half) ** 2
    moved: ComplexArray = (raw * np.exp(1j * own)[:, None]).astype(np.complex64)
    return moved


def decompressed(image: ComplexArray, geometry: StripmapGeometry, threads: int) -> ComplexArray:
    """Raw signal of an image."""
    from .. import azimuth_decompress  # noqa: PLC0415

    return azimuth_decompress(image.astype(np.complex64), geometry, threads=threads)


def noise(shape: tuple[int, int], generator: np.random.Generator) -> npt.NDArray[np.complex128]:
    """Speckle of power one."""
    speckle: npt.NDArray[np.complex128] = (generator.standard_normal(shape) + 1j * generator.standard_normal(shape)) / np.sqrt(2.0)
    return speckle


def texture(kind: str, shape: tuple[int, int], generator: np.random.Generator) -> FloatArray:
    """Amplitude factor of the speckle: of a sea the root of a gamma variable, correlated over a few pixels; K-distributed intensity."""
    if kind != "sea":
        return np.ones(shape)
    order_parameter = generator.uniform(1.0, 8.0)
    coarse = generator.gamma(order_parameter, 1.0 / order_parameter, (shape[0] // 4 + 1, shape[1] // 2 + 1))
    rough: FloatArray = np.sqrt(np.kron(coarse, np.ones((4, 2)))[: shape[0], : shape[1]])
    return rough


def amplitude(generator: np.random.Generator) -> complex:
    """Of a point 18 to 45 dB over the clutter."""
    return complex(10.0 ** (generator.uniform(18.0, 45.0) / 20.0) * np.exp(2j * np.pi * generator.random()))


def clipped(data: npt.NDArray[Any], generator: np.random.Generator) -> npt.NDArray[Any]:
    """Both quadratures limited, as an analogue-to-digital converter driven too far does."""
    limit = generator.uniform(0.5, 1.5) * float(np.sqrt(0.5 * np.mean(np.abs(data) ** 2)))
    limited: npt.NDArray[Any] = np.clip(data.real, -limit, limit) + 1j * np.clip(data.imag, -limit, limit)
    return limited


def phase_error(n: int, generator: np.random.Generator, *, strip: bool) -> FloatArray:
    """Polynomial, smooth, random walk or, in strips, piecewise linear; 0.5 to 8 rad to either side."""
    kind = int(generator.integers(4 if strip else 3))
    x = np.linspace(-1.0, 1.0, n)
    if kind == 0:
        phase = np.polynomial.Legendre(np.r_[0.0, 0.0, generator.standard_normal(4)])(x)
    elif kind == 1:
        phase = smooth_phase(n, 1.0, 8 if strip else 5, generator)
    elif kind == 2:
        phase = np.cumsum(generator.standard_normal(n))
    else:
        ends = np.sort(generator.uniform(0.05, 0.95, 5)) * n
        phase = piecewise_linear(n, ends, generator.standard_normal(6))
    phase = without_line(phase)
    peak = 10.0 ** generator.uniform(np.log10(SMALLEST_ERROR), np.log10(LARGEST_ERROR))
    scaled: FloatArray = phase * (peak / float(np.abs(phase).max()))
    return scaled


def focus(scene: Scene, method: str, threads: int = 0) -> Outcome:
    """Run a method and judge its image by the truth."""
    image = autofocus(scene.image, scene.geometry, method=method, threads=threads).image
    if np.array_equal(image, scene.image):
        return Outcome("unchanged", 0.0, 0.0, scene.error)
    before, after = quality.entropy(scene.image, threads=threads), quality.entropy(image, threads=threads)
    entropy_change = (after - before) / before
    peaks = [peak_db(image, point) - peak_db(scene.image, point) for point in scene.points]
    peak_change = float(np.mean(peaks)) if peaks else float("nan")
    worse = entropy_change > ENTROPY_RISE or peak_change < -PEAK_FALL_DB
    return Outcome("worse" if worse else "improved", entropy_change, peak_change, scene.error)


def peak_db(image: ComplexArray, point: tuple[float, int]) -> float:
    """Largest power along azimuth near a point, between the pixels."""
    line = np.fft.fft(image[:, point[1]].astype(np.complex128))
    half = len(line) // 2
    padded = np.zeros(UPSAMPLE * len(line), np.complex128)
    padded[: len(line) - half], padded[-half:] = line[: len(line) - half], line[len(line) - half :]
    fine = UPSAMPLE * np.fft.ifft(padded)
    near = (round(point[0] * UPSAMPLE) + np.arange(-SEARCH * UPSAMPLE, SEARCH * UPSAMPLE + 1)) % len(fine)
    return float(20.0 * np.log10(np.abs(fine[near]).max()))
