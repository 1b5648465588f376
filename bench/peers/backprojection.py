"""Backprojection side by side with fastsar: speed, error and peak memory together, medians of interleaved runs.

    python bench/peers/backprojection.py --peer ENVIRONMENT/bin/python [--size 2048] [--rounds 5] [--threads 2]

ENVIRONMENT holds fastsar (`python -m venv ENVIRONMENT; ENVIRONMENT/bin/pip install fastsar`). The error is that of random pixels
against the sum in double precision. Our time holds everything, the planning too; the peer's plan is made beforehand and not counted.
Memory is beyond input and image.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import backprojection_job

CONTESTANTS = (
    ("sarfocus", "exact"),
    ("fastsar", "exact:cubic/4"),
    ("fastsar", "exact:linear/8"),
    ("sarfocus", "ffbp:-50"),
    ("sarfocus", "ffbp:-60"),
    ("fastsar", "ffbp:-40"),
    ("fastsar", "ffbp:-60"),
)


class Worker:
    """A contestant in a process of its own."""

    def __init__(self, python: str, name: str, way: str, folder: str, threads: int) -> None:
        self.name = f"{name} {way}"
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
        script = str(Path(__file__).with_name("backprojection_worker.py"))
        self.process = subprocess.Popen(
            [python, script, name, way, folder, str(threads)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=environment,
        )
        self.first = self.answer()
        self.seconds: list[float] = []

    def answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"{self.name} ended without an answer")
        result: dict[str, Any] = json.loads(line)
        return result

    def run(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        self.seconds.append(self.answer()["seconds"])

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--peer", required=True, help="interpreter of the environment with fastsar")
    arguments.add_argument("--size", type=int, default=1024)
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--threads", type=int, default=2)
    arguments.add_argument("--ways", default="", help="only contestants that hold this text")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        backprojection_job.write(Path(folder), options.size)
        workers = [
            Worker(sys.executable if name == "sarfocus" else options.peer, name, way, folder, options.threads)
            for name, way in CONTESTANTS
            if options.ways in f"{name} {way}"
        ]
        for _ in range(options.rounds):
            for worker in workers:
                worker.run()
    print(f"{options.size} x {options.size} pixels, {options.size} pulses, {options.threads} threads, {options.rounds} rounds")
    print(f"{'':24}{'s':>9}{'G/s':>8}{'dB':>8}{'MiB':>8}")
    for worker in workers:
        worker.close()
        seconds = statistics.median(worker.seconds)
        rate = options.size**3 / seconds / 1e9
        print(f"{worker.name:24}{seconds:9.3f}{rate:8.2f}{worker.first['error_db']:8.1f}{worker.first['memory_mib']:8.0f}")


if __name__ == "__main__":
    main()
