"""What is required of speed, error and memory, measured in one run: ratios of times within a round, medians.

    python bench/python/required.py --peer ENVIRONMENT/bin/python [--only pga …] [--rounds 5] [--threads 2] [--json FILE] [--markdown FILE]

`./dev bench required` makes ENVIRONMENT with fastsar. Tables, plans and range transforms are inside our times. Exit status 1 where a
requirement does not hold.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from contest import Contestant, own, take_turns
from jobs import YARDSTICK

import sarfocus

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "peers"))
from backprojection import contest

Contestants = dict[str, Contestant]
CUBIC, LINEAR = "fastsar exact:cubic/4", "fastsar exact:linear/8"
Pair = tuple[Contestant, Contestant]
SAMPLE_MIB = 8 / 2**20


@dataclass
class Row:
    """A ratio and its bound: of speed where it is to be large (`at_least`), of time or memory otherwise."""

    what: str
    ratio: float
    at_least: bool
    bound: float
    aim: float
    error: float | None = None
    unit: str = ""
    error_bound: float | None = None
    memory_images: float | None = None

    @property
    def holds(self) -> bool:
        accurate = self.error is None or self.error_bound is None or self.error <= self.error_bound
        return accurate and self.reaches(self.bound)

    def reaches(self, bound: float) -> bool:
        return self.ratio >= bound if self.at_least else self.ratio <= bound

    @property
    def verdict(self) -> str:
        return "does not hold" if not self.holds else "holds, and the aim" if self.reaches(self.aim) else "holds"

    def cells(self) -> list[str]:
        sign = "≥" if self.at_least else "≤"
        error = "" if self.error is None else f"{self.error:.1f} dB" if self.unit == "dB" else f"{self.error:.4f} {self.unit}"
        limit = "" if self.error_bound is None else f"≤ {self.error_bound:.4g}"
        memory = "" if self.memory_images is None else f"{self.memory_images:.2f}"
        return [self.what, f"{self.ratio:.2f}", f"{sign} {self.bound:g}", f"{self.aim:g}", error, limit, memory, self.verdict]


HEAD = ["what", "ratio", "bound", "aim", "error", "bound", "memory, images", "verdict"]


@dataclass
class Run:
    """How to measure."""

    peer: str
    rounds: int
    threads: int

    def turns(self, jobs: list[str], shape: tuple[int, int]) -> Contestants:
        """Contestants of the same shape, after their rounds."""
        out = {job: own(job, shape, self.threads) for job in jobs}
        take_turns(list(out.values()), self.rounds)
        return out

    def peers(self, ways: list[str], size: int, standoff: float) -> Contestants:
        return contest(ways, size, standoff, rounds=self.rounds, threads=self.threads, peer=self.peer)


def faster(what: str, pair: Pair, size: int, bounds: tuple[float, float], error: float) -> Row:
    """How many times as fast the first is as the second."""
    mine, other = pair
    return Row(what, float(other.over(mine)[1]), True, *bounds, mine.error, mine.unit, error, images(mine, size))


def slower(what: str, pair: Pair, size: int, bounds: tuple[float, float], error: float | None = None) -> Row:
    """How many times the time of the second the first takes."""
    mine, other = pair
    return Row(what, float(mine.over(other)[1]), False, *bounds, mine.error, mine.unit, error, images(mine, size))


def images(one: Contestant, size: int) -> float:
    """Memory beyond input and output, in images."""
    return one.memory_mib / (size**2 * SAMPLE_MIB)


def exact_sums(run: Run) -> Iterator[Row]:
    for standoff in (5000.0, 500.0):
        far = standoff > 1000.0
        found = run.peers(["sarfocus exact", *(["sarfocus points"] if far else []), CUBIC, LINEAR], 1024, standoff)
        name = f"exact backprojection, 1024 pixels and pulses at {standoff:g} m, over fastsar "
        yield faster(name + "cubic 4x", (found["sarfocus exact"], found[CUBIC]), 1024, (5.0, 7.0), -60.0)
        yield faster(name + "linear 8x", (found["sarfocus exact"], found[LINEAR]), 1024, (3.5, 5.0), -60.0)
        if far:
            yield faster("arbitrary points, over fastsar linear 8x", (found["sarfocus points"], found[LINEAR]), 1024, (1.2, 2.0), -50.0)


def factorised(run: Run) -> Iterator[Row]:
    for size in (2048, 4096):
        found = run.peers(["sarfocus ffbp:-60", "fastsar ffbp:-60"], size, 5000.0)
        mine, other = found.values()
        yield faster(f"factorised backprojection, {size}, over fastsar's at its error", (mine, other), size, (1.0, 2.0), other.error)


def whole_images(run: Run) -> Iterator[Row]:
    size = 8192
    ways = {"contiguous": ("", (1.5, 1.2)), "strided": (" strided", (2.5, 2.0))}
    jobs = [f"azimuth_{job}{suffix}" for suffix, _ in ways.values() for job in ("compress", "decompress")]
    found = run.turns([YARDSTICK, *jobs, "pga"], (size, size))
    trip = found[YARDSTICK]
    for way, (suffix, bounds) in ways.items():
        for job in ("compress", "decompress"):
            mine = found[f"azimuth_{job}{suffix}"]
            yield slower(f"{job}, azimuth {way}, {size}, over FFTW's round trip", (mine, trip), size, bounds)
    yield slower(f"pga, {size}, over the round trip", (found["pga"], trip), size, (8.0, 4.0), 0.03)


def autofocus(run: Run) -> Iterator[Row]:
    size = 4096
    linear = "strip spga_linear"
    found = run.turns([YARDSTICK, "pga", "adaptive_pga", "conventional_pga", linear, f"{linear}, unjudged"], (size, size))
    trip = found[YARDSTICK]
    yield slower(f"pga, {size}, over the round trip", (found["pga"], trip), size, (8.0, 4.0), 0.03)
    yield slower(f"adaptive over conventional PGA, {size}", (found["adaptive_pga"], found["conventional_pga"]), size, (1.02, 1.0))
    yield slower(f"spga_linear, {size}, over the round trip", (found[linear], trip), size, (4.0, 2.5))
    yield slower(f"the same, not judged (do_no_harm=False), {size}", (found[f"{linear}, unjudged"], trip), size, (4.0, 2.5))


def multichannel(run: Run) -> Iterator[Row]:
    found = run.turns(["hrws plain", "hrws folded"], (256, 256))
    yield slower("folded reconstruction over plain backprojection", (found["hrws folded"], found["hrws plain"]), 256, (1.3, 1.1), -50.0)


def memory(run: Run) -> Iterator[Row]:
    strip = [f"strip {name}" for name in sarfocus.method_names(strip=True)]
    for job in [*sarfocus.method_names(strip=False), "auto", *strip, "strip auto", "gpga"]:
        size = 1024 if job == "gpga" else 2048
        one = own(job, (size, size), run.threads)
        one.close()
        taken = images(one, size)
        yield Row(f"memory of {job}, {size}, over the image", taken, False, 1.0, 0.25, one.error, one.unit, None, taken)


PARTS: dict[str, Callable[[Run], Iterator[Row]]] = {
    "exact": exact_sums,
    "ffbp": factorised,
    "images": whole_images,
    "autofocus": autofocus,
    "hrws": multichannel,
    "memory": memory,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peer", required=True, help="interpreter of the environment with fastsar")
    parser.add_argument("--only", nargs="*", choices=list(PARTS), default=list(PARTS))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--markdown", type=Path)
    options = parser.parse_args()
    run = Run(options.peer, options.rounds, options.threads)
    print(f"{options.rounds} rounds, {options.threads} threads; ratios within a round, medians; memory beyond input and output")
    rows: list[Row] = []
    for part in options.only:
        for row in PARTS[part](run):
            rows.append(row)
            print("  ".join(f"{text:{width}}" for text, width in zip(row.cells(), (72, 7, 7, 5, 11, 9, 6, 0), strict=True)), flush=True)
    if options.json:
        held = [asdict(row) | {"holds": row.holds} for row in rows]
        options.json.write_text(json.dumps(held, indent=1, default=float) + "\n", encoding="utf-8")
    if options.markdown:
        table = [HEAD, ["---"] * len(HEAD), *(row.cells() for row in rows)]
        options.markdown.write_text("".join(f"| {' | '.join(cells)} |\n" for cells in table), encoding="utf-8")
    missed = [row.what for row in rows if not row.holds]
    print(f"{len(rows) - len(missed)} of {len(rows)} hold" + "".join(f"\nnot: {what}" for what in missed))
    sys.exit(bool(missed))


if __name__ == "__main__":
    main()
