"""Phase errors that change across the swath: one phase for all gates, range blocks, and the cross-track displacement found from them."""

from __future__ import annotations

import argparse
import time

import numpy as np
from numpy.typing import NDArray

import sarfocus

HEIGHT, WAVELENGTH = 6e3, 0.03125
SHAPE = (4096, 256)
Floats = NDArray[np.float64]


def without_lines(values: Floats) -> Floats:
    """Constant and line taken out of every column."""
    k = np.linspace(-1, 1, len(values))
    basis = np.stack([np.ones_like(k), k], axis=1)
    return np.asarray(values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0])


def wobble(rms: float, rng: np.random.Generator) -> Floats:
    """Six slow cycles of random motion, m, towards the scene and up."""
    angle = np.pi * np.outer(np.arange(SHAPE[0]) / SHAPE[0], np.arange(1, 13))
    motion = without_lines(np.cos(angle) @ rng.normal(size=(12, 2)) + np.sin(angle) @ rng.normal(size=(12, 2)))
    return np.asarray(motion / motion.std(axis=0) * rms)


class Scene:
    """Clutter of unit power and points 25 dB above it, 8 to 14 km away from 6 km of height."""

    def __init__(self, points: int, rms: float, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.geometry = sarfocus.StripmapGeometry(
            wavelength=WAVELENGTH, prf=360, velocity=120, slant_range=np.linspace(8e3, 14e3, SHAPE[1]), doppler_bandwidth=300
        )
        azimuth = rng.permutation((np.arange(points) + rng.uniform(0.1, 0.9, points)) * SHAPE[0] / points)
        pixels = np.stack([azimuth, rng.permutation(SHAPE[1])[:points].astype(float)], axis=1)
        values = 10 ** (25 / 20) * np.exp(2j * np.pi * rng.uniform(size=points))
        raw = sarfocus.simulate.stripmap(self.geometry, pixels, values, n_azimuth=SHAPE[0], clutter_power=1.0, seed=seed)
        self.displacement = wobble(rms, rng)
        self.phase = self.phase_of(self.displacement)
        self.image = sarfocus.azimuth_compress((raw * np.exp(1j * self.phase.T)).astype(np.complex64), self.geometry)
        true = sarfocus.azimuth_compress(raw, self.geometry)
        self.entropies = sarfocus.quality.entropy(self.image), sarfocus.quality.entropy(true)

    def phase_of(self, displacement: Floats) -> Floats:
        return sarfocus.strip.cross_track_phase(displacement, self.geometry.slant_range, height=HEIGHT, wavelength=WAVELENGTH)

    def report(self, name: str, phase: Floats, seconds: float) -> None:
        """phase: [n_range, n_azimuth]."""
        rms = without_lines((phase - self.phase).T).std(axis=0)
        corrected = sarfocus.strip.azimuth_correct(self.image, self.geometry, phase, centres=np.arange(SHAPE[1]))
        recovered = (self.entropies[0] - sarfocus.quality.entropy(corrected)) / (self.entropies[0] - self.entropies[1])
        swath = " ".join(f"{np.sqrt((part**2).mean()):5.2f}" for part in np.array_split(rms, 6))
        print(f"  {name:24} {np.sqrt((rms**2).mean()):6.3f} rad, near to far {swath}; entropy recovered {recovered:.3f}; {seconds:.1f} s")


def interpolated(strip: dict[str, Floats]) -> Floats:
    gates, centres = np.arange(SHAPE[1]), strip["block_centre"]
    return np.stack([np.interp(gates, centres, column) for column in strip["block_phase"].T], axis=1)


def run(scene: Scene, blocks: int, passes: int) -> None:
    start = time.perf_counter()
    common = sarfocus.spga_linear(scene.image, scene.geometry)
    scene.report("one phase", np.tile(common.estimate, (SHAPE[1], 1)), time.perf_counter() - start)
    found = np.zeros((SHAPE[0], 2))
    start = time.perf_counter()
    for number in range(1, passes + 1):
        image = sarfocus.strip.correct_cross_track(scene.image, scene.geometry, found, height=HEIGHT)
        strip = sarfocus.spga_linear(image, scene.geometry, range_blocks=blocks, do_no_harm=False).diagnostics["strip"]
        if number == 1:
            scene.report(f"{blocks} blocks, interpolated", interpolated(strip), time.perf_counter() - start)
        ranges = np.interp(strip["block_centre"], np.arange(SHAPE[1]), scene.geometry.slant_range)
        error = sarfocus.strip.cross_track_error(
            strip["block_phase"], ranges, height=HEIGHT, wavelength=WAVELENGTH, phase_std=strip["block_std"]
        )
        found += error.displacement
        scene.report(f"displacement, pass {number}", scene.phase_of(found), time.perf_counter() - start)
    miss = 1e3 * without_lines(found - scene.displacement).std(axis=0)
    predicted = 1e3 * np.sqrt(np.nanmean(error.displacement_std**2, axis=0))
    print(
        f"  displacement wrong by {miss[0]:.2f} mm along the ground, {miss[1]:.2f} mm in height (predicted {predicted[0]:.2f}, "
        f"{predicted[1]:.2f}); condition {error.condition:.1f}; residual {np.array2string(error.residual_rms, precision=2)} rad"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=4)
    parser.add_argument("--passes", type=int, default=2)
    parser.add_argument("--rms", type=float, default=0.02, help="of either component of the displacement, m")
    parser.add_argument("--points", type=int, nargs="*", default=[80, 120, 240])
    parser.add_argument("--seeds", type=int, nargs="*", default=[0, 1])
    arguments = parser.parse_args()
    for points in arguments.points:
        for seed in arguments.seeds:
            print(f"{points} points, seed {seed}, displacement {1e3 * arguments.rms:.0f} mm RMS both ways")
            run(Scene(points, arguments.rms, seed), arguments.blocks, arguments.passes)


if __name__ == "__main__":
    main()
