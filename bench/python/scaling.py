"""How time, error and memory grow with the size: every job at every size, fitted exponents, a picture.

python bench/python/scaling.py [--sizes 512 1024 2048 4096 8192] [--jobs …] [--rounds 3] [--picture scaling.png] [--json scaling.json]
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
from contest import own, take_turns
from jobs import JOBS

JOBS_DRAWN = (
    *("fftw", "azimuth_compress", "conventional_pga", "adaptive_pga", "pga", "strip spga_linear"),
    *("backproject exact", "backproject ffbp"),
)
LARGEST_SUM = 4096  # of backprojection, whose time grows with the cube


def measure(jobs: list[str], sizes: list[int], rounds: int, threads: int) -> list[dict[str, Any]]:
    rows = []
    for size in sizes:
        for name in jobs:
            if name.startswith("backproject") and size > LARGEST_SUM:
                continue
            one = own(name, (size, size), threads)
            take_turns([one], rounds)
            told = {"error": one.error, "unit": one.unit, "memory_mib": one.memory_mib}
            rows.append({"job": name, "size": size, "seconds": one.median} | told)
            print(f"{name:24}{size:6d}{one.median:10.4f} s{one.told_error:>12}{one.memory_mib:8.0f} MiB", flush=True)
    return rows


def exponent(rows: list[dict[str, Any]]) -> float:
    """Power of the size with which the time grows, over the larger half of the sizes: small images are looked at in other ways."""
    held = sorted((row["size"], row["seconds"]) for row in rows)[len(rows) // 2 :]
    return float(np.polyfit(*np.log(np.array(held)).T, 1)[0]) if len(held) > 1 else float("nan")


def draw(rows: list[dict[str, Any]], file: Path) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    sizes = sorted({row["size"] for row in rows})
    for name in dict.fromkeys(row["job"] for row in rows):
        mine = [row for row in rows if row["job"] == name]
        size = [row["size"] for row in mine]
        line = left.loglog(size, [row["seconds"] for row in mine], "o-", label=f"{name}, {exponent(mine):.1f}", markersize=4)
        right.loglog(
            size, [row["memory_mib"] if row["memory_mib"] >= 1.0 else np.nan for row in mine], "o-", color=line[0].get_color(), markersize=4
        )
    right.loglog(sizes, [size**2 * 8 / 2**20 for size in sizes], "k--", linewidth=1, label="the image itself")
    right.legend(frameon=False)
    left.set(ylabel="time, s")
    right.set(ylabel="memory beyond input and output, MiB")
    for axes in (left, right):
        axes.set_xlabel("pixels along either axis")
        axes.set_xticks(sizes, [str(size) for size in sizes])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    title = f"time grows with the power,\nfrom {sizes[len(sizes) // 2]} on"
    figure.legend(*left.get_legend_handles_labels(), title=title, loc="outside right center", frameon=False)
    figure.savefig(file, dpi=90)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="*", default=[512, 1024, 2048, 4096, 8192])
    parser.add_argument("--jobs", nargs="*", choices=sorted(JOBS), default=list(JOBS_DRAWN))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--picture", type=Path, default=Path("scaling.png"))
    parser.add_argument("--json", type=Path)
    parser.add_argument("--draw", type=Path, metavar="JSON", help="measure nothing, draw what an earlier run wrote")
    options = parser.parse_args()
    rows = json.loads(options.draw.read_text()) if options.draw else measure(options.jobs, options.sizes, options.rounds, options.threads)
    for name in dict.fromkeys(row["job"] for row in rows):
        print(f"{name:24} time grows with the size to the power {exponent([row for row in rows if row['job'] == name]):.2f}")
    draw(rows, options.picture)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
