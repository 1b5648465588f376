"""What `sarfocus.cost` predicts against what is measured; with --fit, its coefficients anew.

    python bench/python/cost_model.py [--fit] [--jobs pga …] [--shapes 1024 8192x512 …] [--rounds 5] [--threads 2] [--markdown FILE]

Coefficients are fitted on some shapes and checked on these and on others. Exit status 1 where a prediction is off by more than 30 % (and by
more than 20 ms or 8 MiB, which is what a process does besides). The machine is measured anew beside every
job; of either the shortest time counts.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from contest import own
from jobs import STANDOFF, shape_of
from scipy.optimize import linprog

import sarfocus
from sarfocus import cost
from sarfocus.io import PhaseHistory

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "peers"))
import backprojection_job

Terms = dict[str, float]
Shape = tuple[int, int]
IMAGES = (
    *("auto", *sarfocus.method_names(strip=False)),
    *(f"strip {name}" for name in ("auto", *sarfocus.method_names(strip=True))),
)
SUMS = ("backproject exact", "backproject points", "backproject ffbp", "gpga")
SMALL = [(512, 512), (1024, 1024), (2048, 512), (512, 2048)]
LARGE = [(2048, 1024), (2048, 2048), (4096, 1024), (1024, 4096)]
SLOW = ("auto", "minimum_entropy", "maximum_contrast")
CHOSEN: dict[str, tuple[list[Shape], list[Shape]]] = {
    "backproject ffbp": ([(1024, 1024), (2048, 512), (1024, 2048), (2048, 1024)], [(512, 512), (2048, 2048)]),
    "gpga": ([*SMALL, (2048, 1024)], [(1024, 512), (2048, 2048)]),
    # In the job's 8192 lines it finds nothing, and stops early.
    "conventional_pga": (SMALL + LARGE + [(512, 8192), (4096, 4096)], [(1024, 512), (4096, 2048), (2048, 4096)]),
    # Its memory stops growing with the range gates between 2048 and 4096.
    "pga_2d": (SMALL + LARGE + [(2048, 4096)], [(1024, 512), (4096, 2048)]),
}
LIMIT, LEAST_SECONDS, LEAST_BYTES = 0.3, 0.02, 8 << 20
LEAST_TIME, ENOUGH = 1.0, 10.0  # s, of all rounds: another program may disturb a few short ones, and hardly a long one
COEFFICIENTS = Path(cost.__file__).with_name("cost.json")


@dataclass
class Measurement:
    """A job and what it took, on which machine."""

    job: str
    shape: Shape
    machine: cost.Machine
    seconds: float
    memory: float  # bytes

    def __post_init__(self) -> None:
        self.terms = terms(self.job, self.shape, self.machine)
        self.used = self.shape in shapes(self.job)[0]
        self.name = cost.image_job(self.job, self.shape) if self.job in IMAGES else self.job
        if self.job == "backproject ffbp" and "plan" not in self.terms[1]:
            self.name, self.used = "backproject exact", False

    def rows(self) -> list[tuple[float, float, float]]:
        """Prediction, measurement, and what no prediction is held to, of seconds and of memory."""
        guess = cost.predicted(self.name, *self.terms)
        return [(guess.seconds, self.seconds, LEAST_SECONDS), (guess.memory, self.memory, LEAST_BYTES)]

    def holds(self) -> bool:
        return all(abs(guess - value) <= max(LIMIT * value, least) for guess, value, least in self.rows())


def shapes(job: str) -> tuple[list[Shape], list[Shape]]:
    """Shapes to fit on and others to check."""
    if job in CHOSEN:
        return CHOSEN[job]
    if job in SUMS:
        return SMALL, [(2048, 1024), (2048, 2048)]
    if job.removeprefix("strip ") in SLOW:
        return SMALL + LARGE, [(1024, 512), (2048, 4096)]
    return SMALL + LARGE + [(8192, 512), (512, 8192), (4096, 4096)], [(1024, 512), (4096, 2048), (2048, 4096), (8192, 1024)]


def history(shape: Shape) -> PhaseHistory:
    """The collection of the job of backprojection, without samples."""
    place = backprojection_job.collection(shape, STANDOFF)
    samples = np.broadcast_to(np.zeros(1, np.complex64), (shape[0], place["n_range"]))
    return PhaseHistory(samples, place["positions"], **backprojection_job.options(place))


def terms(job: str, shape: Shape, on: cost.Machine) -> tuple[Terms, Terms]:
    if job in IMAGES:
        return cost.image_terms(shape, on, job.removeprefix("strip "))
    grid = backprojection_job.grid({"shape": shape}, "plane")
    return cost.backproject_terms(history(shape), grid, job.removeprefix("backproject "), on)


def measure(job: str, shape: Shape, rounds: int, threads: int) -> Measurement:
    one = own(job, shape, threads)
    before = cost.measure_machine(threads)
    while len(one.seconds) < rounds or sum(one.seconds) < LEAST_TIME:
        one.run()
        if sum(one.seconds) > ENOUGH:
            break
    one.close()
    after = cost.measure_machine(threads)
    on = cost.Machine(min(before.transform, after.transform), min(before.pixel_pulse, after.pixel_pulse))
    return Measurement(job, shape, on, min(one.seconds), one.memory_mib * 2**20)


def fitted(measured: list[Measurement], which: int) -> Terms:
    """Coefficients, none below zero, with the smallest of largest relative errors; values too small to matter weigh less."""
    values = np.array([(one.seconds, one.memory)[which] for one in measured])
    weights = 1.0 / np.maximum(values, (LEAST_SECONDS, LEAST_BYTES)[which] / LIMIT)
    names = list(measured[0].terms[which])
    table = np.array([[one.terms[which][name] for name in names] for one in measured]) * weights[:, None]
    scale = table.max(axis=0)
    table, aimed = table / scale, values * weights
    # Unknown: the coefficients, and the largest error e. table c - e <= aimed <= table c + e; of equal e, the least sum of coefficients.
    sides = np.block([[table, -np.ones((len(table), 1))], [-table, -np.ones((len(table), 1))]])
    found = linprog(np.r_[np.full(len(names), 1e-6), 1.0], A_ub=sides, b_ub=np.r_[aimed, -aimed], bounds=(0.0, None)).x[:-1] / scale
    return {name: float(f"{value:.4g}") for name, value in zip(names, found, strict=True) if value > 1e-9 / scale.max()}


def fit(measured: list[Measurement]) -> None:
    """Write the coefficients of the jobs measured; the others stay as they are."""
    held = dict(cost.coefficients())
    for name in dict.fromkeys(one.name for one in measured if one.used):
        mine = [one for one in measured if one.name == name and one.used]
        held[name] = {"seconds": fitted(mine, 0), "memory": fitted(mine, 1)}
    COEFFICIENTS.write_text(json.dumps(dict(sorted(held.items())), indent=1) + "\n", encoding="utf-8")
    cost.coefficients.cache_clear()


def line(one: Measurement) -> list[str]:
    (seconds, took, _), (memory, held, _) = one.rows()
    return [
        one.job,
        f"{one.shape[0]} x {one.shape[1]}",
        *(f"{seconds:.3f}", f"{took:.3f}", f"{seconds / took:.2f}"),
        *(f"{memory / 2**20:.0f}", f"{held / 2**20:.0f}", f"{memory / max(held, 1.0):.2f}"),
        ("" if one.holds() else "off") + ("" if one.used else " (not fitted)"),
    ]


def kept(file: Path, jobs: list[str]) -> list[Measurement]:
    """The last measurement of every job and shape in a file."""
    found = {}
    for text in file.read_text(encoding="utf-8").splitlines():
        held = json.loads(text)
        shape = (held["shape"][0], held["shape"][1])
        if held["job"] in jobs:
            found[held["job"], shape] = Measurement(**held | {"shape": shape, "machine": cost.Machine(**held["machine"])})
    return list(found.values())


def measure_all(options: argparse.Namespace) -> list[Measurement]:
    measured = []
    for job in options.jobs:
        to_fit, to_check = shapes(job)
        for shape in options.shapes or (to_fit if options.fit else []) + to_check:
            one = measure(job, shape, options.rounds, options.threads)
            measured.append(one)
            print(f"{job:28} {shape[0]:5d} x {shape[1]:5d} {one.seconds:9.3f} s {one.memory / 2**20:6.0f} MiB", flush=True)
            if options.keep:
                with options.keep.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(one)) + "\n")
    return measured


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--jobs", nargs="*", choices=(*IMAGES, *SUMS), default=[*IMAGES, *SUMS])
    parser.add_argument("--shapes", nargs="*", type=shape_of, help="to check alone; others by default")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--keep", type=Path, metavar="FILE", help="append the measurements, a line each")
    parser.add_argument("--kept", type=Path, metavar="FILE", help="measure nothing, use what an earlier run kept")
    parser.add_argument("--markdown", type=Path)
    options = parser.parse_args()
    measured = kept(options.kept, options.jobs) if options.kept else measure_all(options)
    if options.fit:
        fit(measured)
    head = ["job", "shape", "s, predicted", "measured", "ratio", "MiB, predicted", "measured", "ratio", ""]
    lines = [line(one) for one in measured]
    print("".join(f"{text:>16}" if n else f"{text:28}" for n, text in enumerate(head)))
    for cells in lines:
        print("".join(f"{text:>16}" if n else f"{text:28}" for n, text in enumerate(cells)))
    if options.markdown:
        rows = [head, ["---"] * len(head), *lines]
        options.markdown.write_text("".join(f"| {' | '.join(cells)} |\n" for cells in rows), encoding="utf-8")
    wrong = [one for one in measured if not one.holds()]
    print(f"{len(measured) - len(wrong)} of {len(measured)} predictions hold within {100 * LIMIT:.0f} %")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
