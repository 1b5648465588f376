"""One contestant: reads the job, forms an image for every line on standard input, answers with one line of JSON.

Runs in the contestant's own environment and needs NumPy and the contestant only.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Form = Callable[[], np.ndarray]


def ours(job: Any, way: str, threads: int) -> Form:
    import sarfocus  # noqa: PLC0415  only one contestant is installed here

    size = len(job["positions"])
    pixel = float(job["pixel"])
    corner = -pixel * (size // 2)
    grid = sarfocus.ImageGrid.plane((corner, corner, 0.0), (pixel, 0.0, 0.0), (0.0, pixel, 0.0), (size, size))
    data, positions = job["data"], job["positions"]
    method, _, target = way.partition(":")
    options: dict[str, Any] = {"target_error_db": float(target)} if target else {}
    return lambda: sarfocus.backproject(
        data,
        positions,
        grid,
        range_start=job["start"],
        range_spacing=float(job["spacing"]),
        wavelength=float(job["wavelength"]),
        method=method,
        threads=threads,
        **options,
    )


def fastsar(job: Any, way: str, threads: int) -> Form:
    import fastsar as peer  # noqa: PLC0415

    size, spectrum, pixel = len(job["positions"]), job["spectrum"], float(job["pixel"])
    place = (job["positions"], float(job["first_frequency"]), float(job["frequency_step"]), spectrum.shape[1], size, size, pixel, pixel)
    method, _, setting = way.partition(":")
    if method == "ffbp":
        former = peer.ImageFormer(*place, backend="cpu", window=False, target_db=float(setting), ref=job["reference"])
    else:
        interpolation, upsampling = setting.split("/")
        former = peer.ExactFormer(*place, backend="cpu", window=False, interp=interpolation, upsample=int(upsampling), ref=job["reference"])
    return lambda: former(spectrum)


def memory(field: str) -> float:
    """A field of the kernel's account of this process, MiB: VmRSS is held now, VmHWM was held at most."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(float(line.split()[1]) / 1024 for line in lines if line.startswith(field))


def main() -> None:
    name, way, folder, threads = sys.argv[1:]
    with np.load(Path(folder) / "job.npz") as stored:
        job = {key: stored[key] for key in stored.files}
    del job["data" if name == "fastsar" else "spectrum"]
    form = {"sarfocus": ours, "fastsar": fastsar}[name](job, way, int(threads))
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = memory("VmRSS")
    image = form()
    beyond = memory("VmHWM") - before - image.nbytes / 2**20
    value, truth = image[tuple(job["pixels"].T)], job["truth"]
    scale = np.vdot(value, truth) / np.vdot(value, value)  # the contestants' images differ by a constant factor
    error = 20 * np.log10(np.linalg.norm(scale * value - truth) / np.linalg.norm(truth))
    print(json.dumps({"error_db": error, "memory_mib": beyond}), flush=True)
    for _ in sys.stdin:
        start = time.perf_counter()
        form()
        print(json.dumps({"seconds": time.perf_counter() - start}), flush=True)


if __name__ == "__main__":
    main()
