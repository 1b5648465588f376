"""Speed, error and peak memory of the jobs, interleaved: times of a round are compared within the round; medians and middle halves.

    python bench/python/compare.py [--jobs pga adaptive_pga] [--size 4096] [--rounds 7] [--threads 2] [--against PYTHON]

Without --against: over FFTW's transforms there and back of as many samples, in place. With it: over the same job in another environment, as
`./dev bench against COMMIT` sets it up.
"""

from __future__ import annotations

import argparse
import sys

from contest import Contestant, take_turns
from jobs import DEFAULT_SIZE, JOBS, YARDSTICK


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", nargs="*", choices=sorted(JOBS), default=[name for name in JOBS if name != YARDSTICK])
    parser.add_argument("--size", type=int, help="of the images; each job has one of its own")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--against", metavar="PYTHON", help="interpreter of the other environment")
    options = parser.parse_args()
    scale = "other" if options.against else "FFTW"
    print(f"{options.rounds} rounds, {options.threads} threads; s: median; over {scale}: median (middle half) within a round")
    print(f"{'job':28}{'size':>6}{'s':>9}{'over ' + scale:>24}{'error':>12}{'MiB':>8}{'image':>7}", flush=True)
    for name in options.jobs:
        size = options.size or DEFAULT_SIZE[name]
        own = Contestant(name, size, options.threads)
        other = Contestant(name if options.against else YARDSTICK, size, options.threads, options.against or sys.executable)
        take_turns([own, other], options.rounds)
        low, middle, high = own.over(other)
        image = size * size * 8 / 2**20
        rows = [(own, f"{middle:.3f} ({low:.3f} to {high:.3f})")]
        if options.against:
            rows.append((other, ""))
        for row, ratio in rows:
            seconds = sorted(row.seconds)[len(row.seconds) // 2]
            label = name if row is own else "  other"
            print(
                f"{label:28}{size:6d}{seconds:9.4f}{ratio:>24}{row.error:>12}{row.memory_mib:8.0f}{row.memory_mib / image:7.2f}", flush=True
            )


if __name__ == "__main__":
    main()
