"""sarfocus reproduce zhou2022-table3: its pieces, on a scene of 400 m x 60 m."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sarfocus
from sarfocus import experiments
from sarfocus.experiments import zhou2022_table3 as table3

SMALL = table3.Setup(
    ground=(59.8e3, 60.2e3), along=40.0, pixel=(1.0, 2.0), points=48, points_again=96, pga_chip=(32, 16), strip=2, bp_fmsa_iterations=5
)


@pytest.fixture(scope="module")
def result():
    return table3.run(setup=SMALL, threads=2)


def test_rows_name_every_method_with_the_figures_of_the_paper(result):
    assert [row["method"] for row in result.rows] == list(table3.METHODS)
    assert [row["paper"] for row in result.rows] == [16.4974, 16.4958, 15.8944, None, 15.8259, None]
    assert all(row["seconds"] > 0 and row["peak_gib"] > 0 for row in result.rows)
    assert result.parameters["shape"] == [40, 200]


def test_less_entropy_the_better_the_motion(result):
    entropy = {row["method"]: row["entropy"] for row in result.rows}
    assert entropy[table3.SI_MEC] <= entropy[table3.FIRST] < entropy[table3.NONE]
    # 48 points in clutter, then 96, of 8000 pixels: so few may be made sharper than the truth. The whole scene has thousands.
    assert abs(result.required[0].value) < 0.5
    assert result.required[0].value == pytest.approx(
        (entropy[table3.SI_MEC] - entropy[table3.TRUE]) / (entropy[table3.NONE] - entropy[table3.TRUE])
    )


def test_pictures(result, tmp_path: Path):
    written = table3.draw(result, tmp_path)
    assert [path.name for path in written] == ["zhou2022_table3.png", "zhou2022_table3_detail.png", "zhou2022_table3_motion.png"]
    assert all(path.stat().st_size > 10_000 for path in written)
    assert experiments.PICTURES["zhou2022-table3"] is table3.draw


def test_the_scene_is_the_amplitude_mirrored():
    amplitude = np.arange(12.0).reshape(3, 4)
    scene = table3.coefficients(SMALL, amplitude, 1)
    assert scene.shape == SMALL.scatterers
    np.testing.assert_allclose(np.abs(scene[:3, :4]), amplitude, rtol=1e-6)
    np.testing.assert_allclose(np.abs(scene[3:6, 4:8]), amplitude[::-1, ::-1], rtol=1e-6)
    np.testing.assert_allclose(np.abs(scene[6:9, 8:12]), amplitude, rtol=1e-6)
    assert not np.allclose(scene[:3, :4], scene[6:9, 8:12])  # phases of their own


def test_size_of_the_whole_run():
    whole = table3.Setup()
    assert (whole.ground[1] - whole.ground[0], whole.along) == (20e3, 2e3)  # [Zhou2022, section 4.2]
    assert whole.n_range > (whole.slant[1] - whole.slant[0]) / 0.75
    assert whole.bytes() < 6 * 2**30
    with pytest.raises(sarfocus.MemoryEstimateError, match="needs"):
        table3.run(setup=table3.Setup(along=4e6))


def test_progress_is_shown_and_stops():
    told: list[str] = []

    def listen(phase: str, done: int, total: int) -> bool:
        told.append(phase)
        return len(told) < 3

    with pytest.raises(sarfocus.Cancelled):
        table3.run(setup=SMALL, progress=listen)
    assert "GiB" in told[0]
    assert told[1].startswith("echo")


def test_a_folder_without_the_excerpt_is_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="data"):
        experiments.run("zhou2022-table3", data=tmp_path)


def test_bounds():
    rows: list[dict[str, Any]] = [
        {"method": m, "entropy": e} for m, e in zip(table3.METHODS, (16.5, 16.4, 15.9, 15.802, 15.8011, 15.8), strict=True)
    ]
    (item,) = table3.bounds(rows)
    assert item.value == pytest.approx(0.0011 / 0.7)
    assert item.holds
