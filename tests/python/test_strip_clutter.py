"""The clutter experiment on small strips: its scene, its scores, its bounds, its pictures."""

import json

import numpy as np
import pytest

from sarfocus.cli import main
from sarfocus.experiments import strip_clutter, strips


@pytest.fixture
def small(monkeypatch):
    """A fourth of the strip, with apertures as long as on the whole one against it; two trials."""
    for name, value in {"N_AZIMUTH": 1024, "N_RANGE": 64, "RANGE_START": 3000.0, "DRAWS": 1, "STD_TRIALS": 2}.items():
        monkeypatch.setattr(strip_clutter, name, value)


def made(seed=1, n_point=20, peak_db=25.0):
    geometry = strips.airborne(64, 3000.0, 0.5)
    generator = np.random.default_rng(seed)
    return strip_clutter.make(geometry, strip_clutter.smooth(1024, generator), generator, n_point=n_point, peak_db=peak_db)


def test_points_stand_over_the_clutter_by_what_is_asked():
    draw = made(peak_db=35.0)
    power = np.abs(draw.truth) ** 2
    # 64 gates of 850 independent values: 0.4 %; 20 points of 35 dB over 1.2 pixels each add some 6 %... so the median is taken.
    assert np.median(power) / np.log(2) == pytest.approx(1.0, rel=0.03)
    peaks = [power[round(u) - 1 : round(u) + 2, g].max() for u, g in draw.points]
    assert 10 * np.log10(np.mean(peaks)) == pytest.approx(34.1, abs=0.5), "between pixels 0.9 dB is lost on average"
    assert len({g for _, g in draw.points}) == 20


def test_focus_scores_in_the_gauge_of_the_truth():
    draw = made()
    found = strip_clutter.focus(draw, 0, image_too=True)
    assert found.row["status"] == "converged"
    assert found.row["rmse"] < 0.35, "0.16 on average over many draws"
    assert found.row["recovered"] > 0.85
    reached = np.isfinite(found.deviation)
    line = np.polynomial.Polynomial.fit(np.flatnonzero(reached), found.error, 1)
    assert np.abs(line(np.arange(1024.0))).max() < 1e-6
    assert found.row["within_two_std"] == np.mean(np.abs(found.error) <= 2 * found.deviation[reached])


def test_bounds():
    def rows(rmse, recovered, within):
        """Four draws of every case; one of the second case differs."""
        scored = [{"points": n, "rmse": 0.1, "recovered": 1.0, "within_two_std": 0.9} for n, _, _ in strip_clutter.CASES for _ in range(4)]
        scored[4] |= {"rmse": rmse, "recovered": recovered}
        return [*scored, {"points": 20, "rmse": 0.2, "recovered": None, "within_two_std": within}]

    assert all(item.holds for item in strip_clutter.required(rows(0.149, 0.9, 0.93)))
    for bad in (rows(0.151, 1.0, 0.95), rows(0.1, 0.89, 0.95), rows(0.1, 1.0, 0.91), rows(0.1, 1.0, 0.99)):
        assert sum(not item.holds for item in strip_clutter.required(bad)) == 1


def test_command_prints_and_draws(small, capfd, tmp_path):
    status = main(["reproduce", "strip-clutter", "--json", "-o", str(tmp_path / "figures"), "--seed", "5"])
    payload = json.loads(capfd.readouterr().out)
    assert status == (0 if all(item["holds"] for item in payload["required"]) else 1)
    assert payload["parameters"]["seed"] == 5
    assert len(payload["rows"]) == 3 * 2 + 1
    assert all({"method", "case", "rmse", "phase_std", "recovered"} <= row.keys() for row in payload["rows"])
    assert len(list((tmp_path / "figures").glob("strip_clutter_*.png"))) == 3


def test_same_seed_same_figures(small):
    first, again = (strip_clutter.run(seed=3) for _ in range(2))
    assert first.rows == again.rows and first.required == again.required
