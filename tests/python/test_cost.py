"""Predicted costs: memory against what a process takes; times are positive, grow with the work, and are those of the machine given."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sarfocus
from reference.histories import history
from sarfocus import cost
from sarfocus.grids import default_grid
from sarfocus.io import Image

WORKER = Path(__file__).resolve().parents[2] / "bench/python/worker.py"
MACHINE = cost.Machine(transform=3e-10, pixel_pulse=4e-10)
LIMIT, LEAST = 0.3, 8 << 20  # of what is measured; bytes of plans, stacks and the allocator, which no size tells
KINDS = [(strip, name) for strip in (False, True) for name in ("auto", *sarfocus.method_names(strip=strip))]


def taken(job: str, shape: tuple[int, int]) -> int:
    """Most memory beyond input and output of a job of the benchmarks, bytes."""
    command = [sys.executable, str(WORKER), job, f"{shape[0]}x{shape[1]}", "2"]
    told = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=True, text=True, timeout=120)
    return int(json.loads(told.stdout.splitlines()[0])["memory_mib"] * 2**20)


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="the kernel doesn't tell the most memory a process held")
@pytest.mark.parametrize("shape", [(2048, 1024), (1024, 3072)], ids=str)
@pytest.mark.parametrize("job", ["pga", "adaptive_pga", "conventional_pga", "strip spga_linear"])
def test_memory_of_autofocus(job: str, shape: tuple[int, int]) -> None:
    predicted = cost.predicted(cost.image_job(job, shape), *cost.image_terms(shape, MACHINE, job)).memory
    measured = taken(job, shape)
    assert abs(predicted - measured) <= max(LIMIT * measured, LEAST)


@pytest.mark.parametrize(("strip", "method"), KINDS)
def test_cost_grows_with_the_image(strip: bool, method: str) -> None:
    shapes = [(1024, 2048), (2048, 2048), (8192, 4096)]
    found = [cost.autofocus_cost(method, shape, strip=strip, on=MACHINE) for shape in shapes]
    for small, large in itertools.pairwise(found):
        assert 0 < small.seconds < large.seconds
        assert 0 < small.memory <= large.memory
    slow = cost.autofocus_cost(method, shapes[-1], strip=strip, on=replace(MACHINE, transform=2 * MACHINE.transform))
    assert slow.seconds == pytest.approx(2 * found[-1].seconds)


@pytest.mark.parametrize("method", ["exact", "ffbp", "gpga"])
def test_cost_grows_with_the_grid(method: str) -> None:
    recorded = history()
    grids = [default_grid(recorded, size=(extent, extent), spacing=(0.05, 0.05)) for extent in (5.0, 10.0, 40.0)]
    found = [cost.backproject_cost(recorded, grid, method, on=MACHINE) for grid in grids]
    assert 0 < found[0].seconds < found[1].seconds < found[2].seconds
    assert all(one.memory > 0 for one in found)


def test_points_take_longer_than_a_plane() -> None:
    recorded = history()
    plane = default_grid(recorded, size=(40.0, 40.0), spacing=(0.1, 0.1))
    points = sarfocus.ImageGrid.from_points(np.array([[plane.position(i, j) for j in range(400)] for i in range(400)]))
    costs = [cost.backproject_cost(recorded, grid, on=MACHINE).seconds for grid in (plane, points)]
    assert costs[0] < costs[1]


def test_factorising_is_never_predicted_where_it_is_not_done() -> None:
    """So few pulses are summed exactly, at the cost of that."""
    recorded = history(n_pulse=16)
    grid = default_grid(recorded)
    assert cost.backproject_cost(recorded, grid, "ffbp", on=MACHINE) == cost.backproject_cost(recorded, grid, on=MACHINE)


def test_the_machine_is_measured_once() -> None:
    first = cost.machine(1)
    assert first.transform > 0 and first.pixel_pulse > 0
    assert cost.machine(1) is first


def test_every_method_of_an_image_is_predicted() -> None:
    image = np.ones((256, 64), np.complex64)
    geometry = sarfocus.StripmapGeometry(wavelength=0.03, prf=500, velocity=100, slant_range=1e4 + np.arange(64), doppler_bandwidth=400)
    assert list(cost.costs(Image(image))) == ["auto", *sarfocus.method_names(strip=False)]
    assert list(cost.costs(Image(image, geometry=geometry))) == ["auto", *sarfocus.method_names(strip=True)]


def test_what_cannot_be_predicted_is_refused() -> None:
    with pytest.raises(ValueError, match=r"method: expected one of auto, spga_linear.*got 'pga'"):
        cost.autofocus_cost("pga", (64, 64), strip=True, on=MACHINE)
    with pytest.raises(ValueError, match="method: expected exact, ffbp or gpga, got 'fast'"):
        cost.backproject_cost(history(), default_grid(history()), "fast", on=MACHINE)
    with pytest.raises(ValueError, match="grid"):
        cost.costs(history())


def test_what_is_too_large_does_not_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cost, "available_memory", lambda: 1000)
    assert cost.fits(cost.Cost(1.0, 600), 400)
    assert not cost.fits(cost.Cost(1.0, 600), 401)
    monkeypatch.setattr(cost, "available_memory", lambda: 0)
    assert cost.fits(cost.Cost(1.0, 1 << 60))
