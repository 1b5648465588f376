"""Processes that take turns at the same machine, and what their times say."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

WORKER = Path(__file__).with_name("worker.py")


@dataclass
class Contestant:
    """A job in a process of its own; the first run is not timed and tells error and memory."""

    name: str
    command: Sequence[str]
    threads: int
    seconds: list[float] = field(default_factory=list)
    error: float = 0.0
    unit: str = ""
    memory_mib: float = 0.0

    def __post_init__(self) -> None:
        environment = os.environ | {"OMP_NUM_THREADS": str(self.threads)}
        self.process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
        first = self.answer()
        self.error, self.unit, self.memory_mib = first["error"], first["unit"], first["memory_mib"]

    def answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.name}: {' '.join(self.command)} ended without an answer")
        told: dict[str, Any] = json.loads(line)
        return told

    def run(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        self.seconds.append(self.answer()["seconds"])

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()

    @property
    def median(self) -> float:
        return float(np.median(self.seconds))

    @property
    def told_error(self) -> str:
        return f"{self.error:.1f} dB" if self.unit == "dB" else f"{self.error:.4f} {self.unit}"

    def over(self, other: Contestant) -> NDArray[np.float64]:
        """Ratios of the times within a round: quarter, median, three quarters."""
        return np.asarray(np.percentile(np.array(self.seconds) / np.array(other.seconds), [25, 50, 75]))


def own(job: str, shape: tuple[int, int], threads: int, python: str = sys.executable) -> Contestant:
    """One of `jobs.JOBS`, in this environment or another one."""
    return Contestant(job, [python, str(WORKER), job, f"{shape[0]}x{shape[1]}", str(threads)], threads)


def take_turns(contestants: Sequence[Contestant], rounds: int) -> None:
    """Run all once in every round, the order turned from round to round; stop their processes."""
    for turn in range(rounds):
        first = turn % len(contestants)
        for contestant in (*contestants[first:], *contestants[:first]):
            contestant.run()
    for contestant in contestants:
        contestant.close()
