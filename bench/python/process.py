"""What a contestant's process does; needs nothing but the standard library, so that it runs in any environment."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

STATUS, RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def held(field: str) -> float:
    """A field of the kernel's account of this process, MiB: VmRSS now, VmHWM at most."""
    return next(float(line.split()[1]) / 1024 for line in STATUS.read_text().splitlines() if line.startswith(field))


def serve(call: Callable[[], Any], worth: Callable[[Any], dict[str, Any]], *, returned: bool, restore: Callable[[], None]) -> None:
    """Call once and tell what that is worth and the most memory it took, less what it `returned` if that is new; then time a call for every
    line on standard input.
    """
    RESET.write_text("5")  # the most starts again from now
    before = held("VmRSS")
    made = call()
    memory = held("VmHWM") - before - (made.nbytes / 2**20 if returned else 0.0)
    restore()
    print(json.dumps(worth(made) | {"memory_mib": max(memory, 0.0)}), flush=True)
    del made
    for _ in sys.stdin:
        started = time.perf_counter()
        made = call()
        seconds = time.perf_counter() - started
        del made
        restore()
        print(json.dumps({"seconds": seconds}), flush=True)
