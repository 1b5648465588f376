"""Speed, error and peak memory of the jobs, interleaved: times of a round are compared within the round; medians and middle halves.

    python bench/python/compare.py [--jobs pga adaptive_pga] [--shape 4096] [--rounds 7] [--threads 2] [--against PYTHON]

Without --against: over FFTW's transforms there and back of as many samples, in place. With it: over the same job in another environment, as
`./dev bench against COMMIT` sets it up.
"""

from __future__ import annotations

import argparse
import sys

from contest import own, take_turns
from jobs import JOBS, YARDSTICK, own_shape, shape_of


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", nargs="*", choices=sorted(JOBS), default=[name for name in JOBS if name != YARDSTICK])
    parser.add_argument("--shape", type=shape_of, help="of the images, 4096 or 8192x512; each job has one of its own")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--against", metavar="PYTHON", help="interpreter of the other environment")
    options = parser.parse_args()
    scale = "other" if options.against else "FFTW"
    print(f"{options.rounds} rounds, {options.threads} threads; s: median; over {scale}: median (middle half) within a round")
    print(f"{'job':28} {'shape':>11} {'s':>9} {'over ' + scale:>26} {'error':>11} {'MiB':>6} {'images':>6}", flush=True)
    for name in options.jobs:
        shape = options.shape or own_shape(name)
        mine = own(name, shape, options.threads)
        other = own(name if options.against else YARDSTICK, shape, options.threads, options.against or sys.executable)
        take_turns([mine, other], options.rounds)
        low, middle, high = mine.over(other)
        image = shape[0] * shape[1] * 8 / 2**20
        rows = [(name, mine, f"{middle:.4g} ({low:.4g} to {high:.4g})")]
        if options.against:
            rows.append(("  other", other, ""))
        for label, one, ratio in rows:
            size = f"{shape[0]} x {shape[1]}"
            figures = f"{one.median:9.4f} {ratio:>26} {one.told_error:>11} {one.memory_mib:6.0f} {one.memory_mib / image:6.2f}"
            print(f"{label:28} {size:>11} {figures}", flush=True)


if __name__ == "__main__":
    main()
