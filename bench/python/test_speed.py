"""Every job at its own size, timed alone: statistics by pytest-benchmark, error and memory beside them in its table and files."""

from __future__ import annotations

import pytest
from contest import Contestant
from jobs import DEFAULT_SIZE, JOBS


@pytest.mark.parametrize("name", list(JOBS))
def test_speed(benchmark, name: str) -> None:
    one = Contestant(name, DEFAULT_SIZE[name], 2)
    benchmark.pedantic(one.run, rounds=5)
    one.close()
    benchmark.extra_info |= {"size": one.size, "error": one.error, "memory_mib": round(one.memory_mib, 1)}
    print(f"{name}, size {one.size}: error {one.error}, memory {one.memory_mib:.0f} MiB")
