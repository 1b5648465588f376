"""One job in a process of its own: makes it, then runs it once for every line on standard input and answers with a line of JSON.

Runs in the environment whose sarfocus is to be timed. Memory is the most that the first call took.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from jobs import JOBS

STATUS, RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def held(field: str) -> float:
    """A field of the kernel's account of this process, MiB: VmRSS now, VmHWM at most."""
    return next(float(line.split()[1]) / 1024 for line in STATUS.read_text().splitlines() if line.startswith(field))


def main() -> None:
    name, size, threads = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    job = JOBS[name](size, threads)
    RESET.write_text("5")  # the most starts again from now
    before = held("VmRSS")
    made = job.call()
    memory = held("VmHWM") - before
    job.restore()
    print(json.dumps({"error": job.error(made), "memory_mib": max(memory, 0.0)}), flush=True)
    for _ in sys.stdin:
        started = time.perf_counter()
        job.call()
        seconds = time.perf_counter() - started
        job.restore()
        print(json.dumps({"seconds": seconds}), flush=True)


if __name__ == "__main__":
    main()
