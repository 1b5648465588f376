"""Every job at its own size, timed alone: statistics by pytest-benchmark, error and memory beside them in its table and files."""

from __future__ import annotations

import pytest
from contest import own
from jobs import JOBS, own_shape


@pytest.mark.parametrize("name", list(JOBS))
def test_speed(benchmark, name: str) -> None:
    rows, columns = own_shape(name)
    one = own(name, (rows, columns), 2)
    benchmark.pedantic(one.run, rounds=5)
    one.close()
    benchmark.extra_info |= {"shape": [rows, columns], "error": one.told_error, "memory_mib": round(one.memory_mib, 1)}
    print(f"{name}, {rows} x {columns}: error {one.told_error}, memory {one.memory_mib:.0f} MiB")
