"""The seven-point experiment: its scene, its gauge, its bounds, what the commands print and draw. On a quarter of the size in both axes."""

import json

import numpy as np
import pytest

import sarfocus
from sarfocus import experiments, simulate
from sarfocus.cli import main
from sarfocus.experiments import strips, xie2023, xie2023_time

SMALL = 1024


@pytest.fixture(scope="module")
def result():
    return xie2023.run(n=SMALL)


def test_slope_of_shift_displaces_by_so_many_pixels():
    geometry = strips.airborne(64, 3000.0, 0.5)
    n, shift, gate = 1024, 5.25, 40
    phase = strips.piecewise_linear(n, [], [strips.slope_of_shift(geometry, shift, gate)])
    strip = simulate.stripmap(geometry, [(400.0, gate)], [1.0], n_azimuth=n, phase_error=phase)
    image = sarfocus.azimuth_compress(strip, geometry)
    found = sarfocus.quality.point_response(image, (400 + shift, gate), oversampling=(1.2, 1.0))
    # The strip is periodic and the phase is not: the jump at its ends lies in the far side lobes.
    assert found.azimuth.position == pytest.approx(400 + shift, abs=0.02)


def test_piecewise_linear_is_continuous_with_the_slopes_asked_for():
    phase = strips.piecewise_linear(10, [3, 7], [0.5, -1.0, 0.25])
    np.testing.assert_allclose(np.diff(phase), [0.5] * 2 + [-1.0] * 4 + [0.25] * 3)


def test_aligned_takes_off_the_line_where_told():
    truth = np.sin(np.arange(50.0))
    estimate = truth + 3.0 - 0.2 * np.arange(50)
    where = np.arange(50) < 40
    estimate[~where] += 1.0
    moved = strips.aligned(estimate, truth, where)
    np.testing.assert_allclose(moved[where], truth[where], atol=1e-12)
    np.testing.assert_allclose(moved[~where], truth[~where] + 1.0, atol=1e-12)


def test_relative_shift_forgets_one_line_over_the_strip():
    """A slope over the whole strip displaces a point by slope / (2 pi K), K as 1 / range: in proportion to its range."""
    scene = xie2023.make_scene(xie2023.table_geometry(256), xie2023.SHIFTS, np.random.default_rng(1))
    slant_range = np.asarray(scene.geometry.slant_range)[[gate for _, gate in scene.points]]
    odd = np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = xie2023.relative(scene, [xie2023.Measured(s, 0.0, 0.0) for s in 0.01 * slant_range + odd])
    left = np.array([one.relative_shift for one in found])
    assert left[1] > 0.24 and abs(left @ slant_range) < 1e-9 * slant_range.sum()


def test_error_free_points_are_ideal(result):
    points = [row for row in result.rows if row["method"] == "error-free"]
    assert [row["case"] for row in points] == [*(f"P{n}" for n in range(1, 8)), "average"]
    for row in points:
        assert abs(row["shift"]) < 1e-4, "the sample grid is 32 times finer, then a parabola"
        assert row["pslr_db"] == pytest.approx(-13.26, abs=0.02)
        assert row["islr_db"] == pytest.approx(-10.11, abs=0.02)


def test_linear_phases_are_kept_where_iterations_lose_them(result):
    def largest(method):
        return max(abs(row["relative_shift"]) for row in result.rows if row["method"] == method and row["case"] != "average")

    assert largest("A error only") > 2.0
    assert largest("C spga, 6 passes") > 0.3
    assert largest("D slope") < 0.1, "apertures of 250 samples, a fourth of the table's: 0.04 pixels"


def test_the_papers_figures_stand_beside_ours(result):
    rows = {(row["method"], row["case"]): row for row in result.rows}
    assert rows["C spga, 6 passes", "average"]["paper_shift"] == 8.42
    assert rows["D search", "P7"]["paper_islr_db"] == -9.22
    assert rows["D slope", "P1"]["paper_pslr_db"] is None
    for method, figures in xie2023.PAPER.items():
        for name, values in figures.items():
            assert np.mean(values[:7]) == pytest.approx(values[7], abs=0.011), (method, name)


def test_bounds_are_those_of_every_point():
    free = [xie2023.Measured(0.0, -13.26, -10.11) for _ in range(7)]
    good = [xie2023.Measured(0.0, -13.22, -10.09, 0.019) for _ in range(7)]
    assert all(item.holds for item in xie2023.required({"error-free": free, "D slope": good, "D search": good}))
    for spoilt in ({"relative_shift": -0.021}, {"pslr_db": -13.15}, {"islr_db": -10.2}):
        bad = [*good[:6], xie2023.Measured(**({"shift": 0.0, "pslr_db": -13.26, "islr_db": -10.11} | spoilt))]
        assert sum(not item.holds for item in xie2023.required({"error-free": free, "D slope": bad, "D search": good})) == 1


def test_same_seed_same_draws():
    first, again = (xie2023.run_random(n=SMALL, seed=3) for _ in range(2))
    assert first == again
    assert len(first.required) == 6 * xie2023.DRAWS
    assert first.parameters != xie2023.run_random(n=SMALL, seed=4).parameters


def test_neighbouring_apertures_overlap_in_every_draw():
    for seed in range(50):
        geometry = xie2023.random_geometry(np.random.default_rng(seed), 512)
        assert 0.18 * 512 <= geometry.aperture_samples(0) <= 0.25 * 512
        step = (511 - 2 * xie2023.MARGIN * geometry.aperture_samples(511)) / 6
        assert 1.4 * step < geometry.aperture_samples(0), "two points 0.2 steps further apart than even"


def test_command_prints_and_draws(capfd, tmp_path, monkeypatch):
    monkeypatch.setitem(experiments.EXPERIMENTS, "xie2023-table3", lambda **options: xie2023.run(n=SMALL, **options))
    status = main(["reproduce", "xie2023-table3", "--json", "-o", str(tmp_path / "figures")])
    captured = capfd.readouterr()
    payload = json.loads(captured.out)
    assert set(payload) == {"name", "parameters", "rows", "required"}
    assert status == (0 if all(item["holds"] for item in payload["required"]) else 1)
    assert len(payload["rows"]) == 8 * 8
    assert {"wavelength", "prf", "velocity", "slant_range", "fm_rate", "lobes"} <= payload["parameters"].keys()
    assert len(list((tmp_path / "figures").glob("xie2023_*.png"))) == 4


def test_times_are_ratios_within_a_round(monkeypatch):
    monkeypatch.setattr(xie2023_time, "ROUNDS", 2)
    found = xie2023_time.run(n=512)
    assert len(found.rows) == 10 and len(found.required) == 4
    for row in found.rows:
        assert row["from"] <= row["seconds"] <= row["to"]
        if row["method"] == "azimuth round trip":
            assert row["round_trips"] == 1.0
