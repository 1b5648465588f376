"""Range-Doppler image formation through the bindings: time against azimuth compression (one transform there and back), error, memory."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable

import numpy as np

import sarfocus

ROUNDS = 5
SAMPLING = 180e6
SPACING = 299_792_458.0 / (2 * SAMPLING)
COLLECTION = {"wavelength": 0.031, "prf": 640.0, "velocity": 120.0, "doppler_bandwidth": 500.0}


def best_of(call: Callable[[], object]) -> float:
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def exact_gate(echo: np.ndarray, range_start: float, closest: float) -> np.ndarray:
    """Sum over the exact two-dimensional spectrum in double precision, one range gate, no squint."""
    n_pulse, n_fast_time = echo.shape
    carrier = 299_792_458.0 / COLLECTION["wavelength"]
    f = np.fft.fftfreq(n_pulse, 1 / COLLECTION["prf"])
    fr = np.fft.fftfreq(n_fast_time + 64, 1 / SAMPLING)
    line = np.zeros(n_pulse, np.complex128)
    spectrum = np.fft.fft(echo, axis=0)
    half = COLLECTION["doppler_bandwidth"] / 2
    for k in np.flatnonzero((f >= -half) & (f < half)):
        root = np.sqrt((carrier + fr) ** 2 - (299_792_458.0 * f[k] / (2 * COLLECTION["velocity"])) ** 2)
        cycles = (2 * closest * (root - carrier) - 2 * fr * range_start) / 299_792_458.0
        line[k] = np.exp(2j * np.pi * cycles) @ np.fft.fft(spectrum[k], len(fr)) / len(fr)
    return np.fft.ifft(line)


def main() -> None:
    shape = (8192, 2048)
    ranges = 4000.0 + SPACING * np.arange(shape[1])
    geometry = sarfocus.StripmapGeometry(**COLLECTION, slant_range=ranges)
    targets = [(4096.0, 1000.4), (4000.0, 1003.7)]
    echo = sarfocus.simulate.stripmap_echo(geometry, targets, [1, 1j], n_azimuth=shape[0], range_bandwidth=150e6, window="hamming")
    timing = {"range_start": 4000.0, "range_sampling": SAMPLING}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    image = sarfocus.form_stripmap(echo, geometry, **timing)
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    out = np.empty_like(echo)
    ours = best_of(lambda: sarfocus.form_stripmap(echo, geometry, **timing, out=out))
    scale = best_of(lambda: sarfocus.azimuth_compress(echo, geometry, out=out))
    near = slice(700, 1300)
    expected = exact_gate(echo[:, near].astype(np.complex128), ranges[near.start], ranges[1001])
    error = 20 * np.log10(np.linalg.norm(image[:, 1001] - expected) / np.linalg.norm(expected))
    print(f"form_stripmap {shape[0]} x {shape[1]}: {1e3 * ours:.0f} ms, azimuth_compress {1e3 * scale:.0f} ms ({ours / scale:.1f} times)")
    print(f"difference from the exact sum {error:.1f} dB; peak memory {memory:.0f} MiB, the image {image.nbytes / 2**20:.0f}")


if __name__ == "__main__":
    main()
