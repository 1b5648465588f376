"""Backprojection side by side with fastsar: speed, error and peak memory together, medians of interleaved runs.

    python bench/peers/backprojection.py --peer ENVIRONMENT/bin/python [--size 2048] [--range 500] [--rounds 5] [--threads 2]

ENVIRONMENT holds fastsar (`python -m venv ENVIRONMENT; ENVIRONMENT/bin/pip install fastsar`). The error is that of random pixels
against the sum in double precision. Our time holds everything, the planning too; the peer's plan is made beforehand and not counted.
"points" are those of a hilly terrain, which the peer cannot form: compare its rate. Memory is beyond input and image.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import backprojection_job

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
from contest import Contestant, take_turns

WORKER = Path(__file__).with_name("backprojection_worker.py")
WAYS = (
    "sarfocus exact",
    "sarfocus points",
    "fastsar exact:cubic/4",
    "fastsar exact:linear/8",
    "sarfocus ffbp:-50",
    "sarfocus ffbp:-60",
    "fastsar ffbp:-40",
    "fastsar ffbp:-60",
)


def contest(ways: list[str], size: int, standoff: float, *, rounds: int, threads: int, peer: str) -> dict[str, Contestant]:
    """Contestants by their way, after so many rounds of the same job."""
    with tempfile.TemporaryDirectory() as folder:
        backprojection_job.write(Path(folder), (size, size), standoff)
        contestants = {}
        for way in ways:
            name, setting = way.split()
            python = sys.executable if name == "sarfocus" else peer
            contestants[way] = Contestant(way, [python, str(WORKER), name, setting, folder, str(threads)], threads)
    take_turns(list(contestants.values()), rounds)
    return contestants


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--peer", required=True, help="interpreter of the environment with fastsar")
    arguments.add_argument("--size", type=int, default=1024)
    arguments.add_argument("--range", type=float, default=5000.0, dest="standoff", help="from the track to the middle of the scene, m")
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--threads", type=int, default=2)
    arguments.add_argument("--ways", default="", help="only contestants that hold this text")
    options = arguments.parse_args()
    ways = [way for way in WAYS if options.ways in way]
    contestants = contest(ways, options.size, options.standoff, rounds=options.rounds, threads=options.threads, peer=options.peer)
    print(
        f"{options.size} x {options.size} pixels, {options.size} pulses at {options.standoff:g} m, "
        f"{options.threads} threads, {options.rounds} rounds"
    )
    print(f"{'':24}{'s':>9}{'G/s':>8}{'error':>12}{'MiB':>8}")
    for way, one in contestants.items():
        print(f"{way:24}{one.median:9.3f}{options.size**3 / one.median / 1e9:8.2f}{one.told_error:>12}{one.memory_mib:8.0f}")


if __name__ == "__main__":
    main()
