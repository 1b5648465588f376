"""One contestant: backprojection_worker.py NAME WAY FOLDER THREADS reads the job and forms an image for every line on standard input.

Runs in the contestant's own environment and needs NumPy and the contestant only.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import backprojection_job
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
from process import serve

Form = Callable[[], np.ndarray]


def ours(job: dict[str, Any], way: str, threads: int) -> Form:
    import sarfocus  # noqa: PLC0415  only one contestant is installed here

    method, _, target = way.partition(":")
    points = method == "points"
    grid = backprojection_job.grid(job, "points" if points else "plane")
    how = backprojection_job.options(job) | {"method": "exact" if points else method, "threads": threads}
    how |= {"target_error_db": float(target)} if target else {}
    return lambda: sarfocus.backproject(job["data"], job["positions"], grid, **how)


def fastsar(job: dict[str, Any], way: str, threads: int) -> Form:
    import fastsar as peer  # noqa: PLC0415

    spectrum, pixel = job["spectrum"], backprojection_job.PIXEL
    rows, columns = (int(extent) for extent in job["shape"])
    frequencies = float(job["first_frequency"]), float(job["frequency_step"]), spectrum.shape[1]
    place = (job["positions"], *frequencies, rows, columns, pixel, pixel)
    method, _, setting = way.partition(":")
    if method == "ffbp":
        former = peer.ImageFormer(*place, backend="cpu", window=False, target_db=float(setting), ref=job["reference"])
    else:
        interpolation, upsampling = setting.split("/")
        former = peer.ExactFormer(*place, backend="cpu", window=False, interp=interpolation, upsample=int(upsampling), ref=job["reference"])
    return lambda: former(spectrum)


def worth(job: dict[str, Any], image: np.ndarray, over: str) -> dict[str, Any]:
    """The contestants' images differ by a constant factor."""
    value, truth = image[tuple(job["pixels"].T)], job[f"truth_{over}"]
    scale = np.vdot(value, truth) / np.vdot(value, value)
    return {"error": float(20 * np.log10(np.linalg.norm(scale * value - truth) / np.linalg.norm(truth))), "unit": "dB"}


def main() -> None:
    name, way, folder, threads = sys.argv[1:]
    job = backprojection_job.read(Path(folder))
    del job["data" if name == "fastsar" else "spectrum"]
    form = {"sarfocus": ours, "fastsar": fastsar}[name](job, way, int(threads))
    over = "points" if way == "points" else "plane"
    serve(form, lambda image: worth(job, image, over), returned=True, restore=lambda: None)


if __name__ == "__main__":
    main()
