"""How time, error and memory grow with the size: every job at every size in turns, fitted exponents, a picture.

python bench/python/scaling.py [--sizes 512 1024 2048 4096] [--jobs …] [--rounds 3] [--picture scaling.png] [--json scaling.json]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from contest import Contestant, take_turns
from jobs import JOBS

JOBS_DRAWN = ("fftw", "azimuth_compress", "conventional_pga", "adaptive_pga", "pga", "spga_linear", "backproject exact", "backproject ffbp")


def measure(jobs: list[str], sizes: list[int], rounds: int, threads: int) -> list[dict[str, Any]]:
    rows = []
    for size in sizes:
        for name in jobs:
            one = Contestant(name, size, threads)
            take_turns([one], rounds)
            seconds = float(np.median(one.seconds))
            rows.append({"job": name, "size": size, "seconds": seconds, "error": one.error, "memory_mib": one.memory_mib})
            print(f"{name:24}{size:6d}{seconds:10.4f} s{one.error:>12}{one.memory_mib:8.0f} MiB", flush=True)
    return rows


def exponent(rows: list[dict[str, Any]]) -> float:
    """Power of the size with which the time grows."""
    return float(np.polyfit(np.log([row["size"] for row in rows]), np.log([row["seconds"] for row in rows]), 1)[0])


def draw(rows: list[dict[str, Any]], file: Path) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    for name in dict.fromkeys(row["job"] for row in rows):
        own = [row for row in rows if row["job"] == name]
        size = [row["size"] for row in own]
        line = left.loglog(size, [row["seconds"] for row in own], "o-", label=f"{name}: {exponent(own):.2f}", markersize=4)
        image = [row["memory_mib"] / (row["size"] ** 2 * 8 / 2**20) for row in own]
        right.semilogx(size, image, "o-", color=line[0].get_color(), markersize=4)
    left.set(xlabel="pixels along either axis", ylabel="time, s")
    left.legend(title="grows with the power", fontsize="small")
    right.set(xlabel="pixels along either axis", ylabel="memory beyond input and output, images", ylim=(0.0, None))
    for axes in (left, right):
        axes.set_xticks(sorted({row["size"] for row in rows}), [str(n) for n in sorted({row["size"] for row in rows})])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    figure.savefig(file, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="*", default=[512, 1024, 2048, 4096])
    parser.add_argument("--jobs", nargs="*", choices=sorted(JOBS), default=list(JOBS_DRAWN))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--picture", type=Path, default=Path("scaling.png"))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows = measure(options.jobs, options.sizes, options.rounds, options.threads)
    for name in options.jobs:
        print(f"{name:24} time grows with the size to the power {exponent([row for row in rows if row['job'] == name]):.2f}")
    draw(rows, options.picture)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
