"""Processes that take turns at the same machine, and what their times say."""

from __future__ import annotations

import json
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
    """A job in an environment of its own; the first run is not timed and tells error and memory."""

    name: str
    size: int
    threads: int
    python: str = sys.executable
    seconds: list[float] = field(default_factory=list)
    error: str = ""
    memory_mib: float = 0.0

    def __post_init__(self) -> None:
        command = [self.python, str(WORKER), self.name, str(self.size), str(self.threads)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        first = self.answer()
        self.error, self.memory_mib = first["error"], first["memory_mib"]

    def answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.name}, size {self.size}: {self.python} ended without an answer")
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

    def over(self, other: Contestant) -> NDArray[np.float64]:
        """Ratios of the times within a round: quarter, median, three quarters."""
        return np.asarray(np.percentile(np.array(self.seconds) / np.array(other.seconds), [25, 50, 75]))


def take_turns(contestants: Sequence[Contestant], rounds: int) -> None:
    """Run all once in every round, the order turned from round to round; stop their processes."""
    for turn in range(rounds):
        first = turn % len(contestants)
        for contestant in (*contestants[first:], *contestants[:first]):
            contestant.run()
    for contestant in contestants:
        contestant.close()
