"""The experiments on scenes with few, without and with many strong points: scenes, errors, scores, bounds; small versions of the runs."""

import functools
import json

import numpy as np
import pytest
import tifffile

from sarfocus import detect, experiments, quality
from sarfocus.cli import main
from sarfocus.experiments import luo2025, luo2025_scenes, luo2025_studies, luo2025_time

SHAPE = (256, 256)


def generator(seed=1):
    return np.random.default_rng(seed)


@pytest.fixture
def amplitude():
    """An excerpt of the size of the measured one: a bright and a dark half, and a few bright pixels in the crop of the first scene."""
    made = np.abs(generator().standard_normal((601, 1401)) + 1j * generator(2).standard_normal((601, 1401)))
    made[300:] *= 0.2
    made[20:120:20, 950] = 100.0
    return made


@pytest.mark.parametrize("order", [0.5, 1.5, 4.0])
def test_texture_has_its_mean_order_and_correlation(order):
    texture = luo2025_scenes.texture(luo2025_scenes.Statistics(order, 4.0, 0.0, (0.0, 0.0)), (1024, 1024), generator())
    # Some 1024^2 / (2 pi 4^2) = 10000 independent values: the variance of order 0.5 is known to a few per cent.
    assert texture.mean() == pytest.approx(1.0, rel=0.05)
    assert texture.var() == pytest.approx(1.0 / order, rel=0.15)
    centred = texture - texture.mean()
    correlation = np.fft.ifft2(np.abs(np.fft.fft2(centred)) ** 2).real
    # Squares of Gaussian fields whose spectrum is a Gaussian, exp(-4 (pi f c)^2) in power: correlation exp(-d^2 / (2 c^2)).
    assert correlation[4, 0] / correlation[0, 0] == pytest.approx(np.exp(-0.5), abs=0.06)
    assert texture.min() >= 0


@pytest.mark.parametrize("scene", luo2025_scenes.SCENES)
@pytest.mark.parametrize("measured", [False, True])
def test_images_fill_their_share_of_the_spectrum(scene, measured, amplitude):
    draw = luo2025_scenes.draw(scene, "order 4", SHAPE, amplitude=amplitude if measured else None, generator=generator())
    for image in (draw.truth, draw.image):
        assert image.shape == SHAPE and image.dtype == np.complex64
        spectrum = np.abs(np.fft.fftshift(np.fft.fft2(image))) ** 2
        band = luo2025_scenes.inside(256, luo2025_scenes.AZIMUTH_SHARE)[:, None] & luo2025_scenes.inside(256, luo2025_scenes.RANGE_SHARE)
        assert spectrum[~band].sum() < 1e-9 * spectrum.sum(), "single precision"
        assert np.mean(np.abs(image) ** 2) == pytest.approx(1.0, rel=1e-4)


def test_points_stand_over_the_clutter_by_what_is_asked():
    statistics = luo2025_scenes.Statistics(50.0, 12.0, 400.0, (30.0, 30.0))
    draw = luo2025_scenes.draw(statistics, "order 2", (512, 512), amplitude=None, generator=generator())
    power = np.abs(draw.truth) ** 2
    clutter = np.median(power) / np.log(2)
    peaks = np.sort(power.ravel())[-100:]  # 400 points in 2^20 pixels: 100 here, on pixels
    assert 10 * np.log10(np.mean(peaks) / clutter) == pytest.approx(30.0, abs=0.3), "clutter adds 0.1 % of the power, at random phase"


def test_crops_are_filled_by_reflection(amplitude):
    for scene, crop in luo2025_scenes.CROPS.items():
        made = np.abs(luo2025_scenes.coefficients(scene, (700, 700), amplitude, generator()))
        cut = amplitude[slice(*crop.azimuth), slice(*crop.range)]
        rows = min(cut.shape[0], 700)
        np.testing.assert_allclose(made[: cut.shape[0], : cut.shape[1]], cut[:700, :700], rtol=1e-6)
        np.testing.assert_allclose(made[rows : 2 * rows, : cut.shape[1]], cut[::-1, :700], rtol=1e-6)


@pytest.mark.parametrize("error", luo2025_scenes.ERRORS)
def test_errors_have_their_gauge_and_size(error):
    phase = luo2025_scenes.phase_error(error, 512, generator())
    assert np.abs(luo2025_scenes.line_of(phase)).max() < 1e-9
    band = luo2025_scenes.inside(512, luo2025_scenes.AZIMUTH_SHARE)
    if error != "smooth":
        # An even power less its mean over the band: from the middle to the ends the whole peak, to a sample of 512.
        assert np.ptp(phase[band]) == pytest.approx(luo2025_scenes.POLYNOMIAL_PEAK, rel=0.03)
    else:
        assert 1.0 < np.std(phase[band]) < 6.0


def test_error_is_a_distance():
    """Minus 4 pi / lambda times three range cells: an echo that comes from three cells farther away."""
    spacing = luo2025_scenes.SPEED_OF_LIGHT / (2 * luo2025_scenes.RANGE_SAMPLING)
    phase = np.full(4, -4 * np.pi / luo2025_scenes.WAVELENGTH * 3 * spacing)
    line = np.fft.ifft(np.fft.ifftshift(luo2025_scenes.full_error(phase, 64), axes=1), axis=1)
    assert np.all(np.argmax(np.abs(line), axis=1) == 3)


def test_scores_do_not_depend_on_the_gauge():
    draw = luo2025_scenes.draw(luo2025_scenes.MANY, "order 4", SHAPE, amplitude=None, generator=generator())
    left = 0.5 * np.sin(np.arange(256.0) / 20)
    image = luo2025.moved_along(draw.truth, -left)
    line = 0.3 + 0.05 * np.arange(256.0)
    plain = luo2025.scored(draw, image, draw.phase_error + left, 0).row
    shifted = luo2025.scored(draw, luo2025.moved_along(image, -line), draw.phase_error + left + line, 0).row
    assert plain["rmse"] == pytest.approx(0.35, abs=0.03)
    for name in ("entropy", "psnr", "rmse"):
        assert shifted[name] == pytest.approx(plain[name], abs=2e-4), "two transforms in single precision"


def test_whole_turns_do_not_count():
    """A third of the aperture a turn off, all of it displaced: the image is the truth's."""
    draw = luo2025_scenes.draw(luo2025_scenes.FEW, "order 4", SHAPE, amplitude=None, generator=generator())
    found = draw.phase_error + 0.2 + 0.7 * np.arange(256.0) + np.where(np.arange(256) < 80, 2 * np.pi, 0.0)
    shifted = luo2025.moved_along(draw.truth, draw.phase_error - found)
    scored = luo2025.scored(draw, shifted, found, 0)
    assert scored.row["rmse"] < 1e-9
    np.testing.assert_allclose(scored.image, draw.truth, rtol=0, atol=1e-4 * np.abs(draw.truth).max())


def test_the_truth_scores_as_the_truth():
    draw = luo2025_scenes.draw(luo2025_scenes.FEW, "smooth", SHAPE, amplitude=None, generator=generator())
    found = luo2025.scored(draw, draw.truth, draw.phase_error, 0).row
    assert found["rmse"] < 1e-9
    assert found["entropy"] == pytest.approx(quality.entropy(draw.truth), abs=1e-5)
    assert found["psnr"] > 100


def test_excerpt_is_asked_for_and_checked(tmp_path, monkeypatch, amplitude):
    monkeypatch.delenv("SARFOCUS_DATA", raising=False)
    assert luo2025_scenes.excerpt(None) is None
    with pytest.raises(ValueError, match="sentinel1"):
        luo2025_scenes.excerpt(tmp_path)
    (tmp_path / "sentinel1").mkdir()
    tifffile.imwrite(tmp_path / "sentinel1" / "a.tiff", np.ones((5, 5), np.complex64))
    with pytest.raises(ValueError, match=r"601.*\(5, 5\)"):
        luo2025_scenes.excerpt(tmp_path)
    tifffile.imwrite(tmp_path / "sentinel1" / "a.tiff", amplitude.astype(np.complex64))
    np.testing.assert_allclose(luo2025_scenes.excerpt(tmp_path), amplitude, rtol=1e-6)


def differences(**worse):
    """Two draws of every scene; adaptive PGA wins by 0.1 nat but for what is said of the second draw of the first scene."""
    out = []
    for scene in luo2025_scenes.SCENES:
        for seed in (1, 2):
            out.append({"scene": scene, "kind": "k", "error": "e", "seed": seed} | dict.fromkeys(luo2025.METHODS[:-1], -0.1))
    out[1] |= worse
    return out


def test_bounds_of_table_7():
    assert all(item.holds for item in luo2025.required(differences()))
    for method, value in (("pga_2d", 0.0011), ("conventional_pga", 0.0011), ("conventional_pga, unjudged", 0.0011), ("input", 1e-9)):
        broken = [item for item in luo2025.required(differences(**{method: value})) if not item.holds]
        assert len(broken) == 1 and luo2025_scenes.FEW in broken[0].what
        assert all(item.holds for item in luo2025.required(differences(**{method: 0.0})))


def test_table_7_prints_and_draws(capfd, tmp_path, monkeypatch):
    monkeypatch.delenv("SARFOCUS_DATA", raising=False)
    monkeypatch.setitem(experiments.EXPERIMENTS, "luo2025-table7", functools.partial(luo2025.run, shape=(128, 128), n_seed=1))
    monkeypatch.setattr(luo2025_scenes, "ERRORS", ("order 4",))
    status = main(["reproduce", "luo2025-table7", "--json", "-o", str(tmp_path / "figures"), "--seed", "5", "--threads", "1"])
    payload = json.loads(capfd.readouterr().out)
    assert status == (0 if all(item["holds"] for item in payload["required"]) else 1)
    assert payload["parameters"]["seeds"] == [5] and "none" in payload["parameters"]["measured"]
    assert len(payload["rows"]) == 3 * len(luo2025.METHODS)
    assert all({"method", "case", "entropy", "entropy_log10", "psnr", "rmse", "status"} <= row.keys() for row in payload["rows"])
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["luo2025_table7_clutter.png"]


def test_measured_scenes_are_taken_where_there_are_data(tmp_path, amplitude, monkeypatch):
    (tmp_path / "sentinel1").mkdir()
    tifffile.imwrite(tmp_path / "sentinel1" / "a.tiff", amplitude.astype(np.complex64))
    monkeypatch.setattr(luo2025_scenes, "ERRORS", ("smooth",))
    monkeypatch.setattr(luo2025_scenes, "SCENES", (luo2025_scenes.MANY,))
    result = experiments.run("luo2025-table7", data=tmp_path, shape=(128, 128), n_seed=1, threads=1)
    assert {row["kind"] for row in result.rows} == set(luo2025_scenes.KINDS)
    assert luo2025.run(data=tmp_path, shape=(128, 128), n_seed=1, threads=1).rows == result.rows, "same seed, same figures"


def test_table_8_prints_ratios_within_rounds(tmp_path):
    result = luo2025_time.run(sizes=((64, 128), (64, 64)), rounds=(2, 1), threads=1)
    assert len(result.rows) == 2 * 3 * 6 and len(result.required) == 2 * 3
    for row in result.rows:
        assert row["from"] <= row["seconds"] <= row["to"]
        assert row["paper_seconds"] is None, "not one of the paper's sizes"
    assert [row["rounds"] for row in result.rows[:6]] == [2, 2, 2, 1, 1, 1]
    assert (result.rows[0]["n_azimuth"], result.rows[0]["n_range"]) == (128, 64)
    assert luo2025_time.draw(result, tmp_path)[0].stat().st_size > 10000


def test_no_round_but_the_first_begins_too_late():
    clock = luo2025_time.Clock({"a": lambda: None}, generator(), 1)
    clock.run(5, 0, budget=-1.0)
    assert len(clock.seconds["a"]) == 1
    clock.run(5, 0)
    assert len(clock.seconds["a"]) == 6


def test_ratios_are_formed_within_a_round():
    clock = luo2025_time.Clock({}, generator(), 1)
    clock.seconds = {"a": [2.0, 30.0, 4.0], "b": [1.0, 10.0, 1.0], "c": [5.0]}
    assert clock.ratios("a", "b") == [2.0, 3.0, 4.0]
    assert clock.ratios("c", "a") == [2.5]


def test_memory_is_that_of_the_job():
    """64 MiB that are written to and freed again."""
    clock = luo2025_time.Clock({"a": lambda: np.ones(2**23).sum(), "b": lambda: None}, generator(), 1)
    clock.run(1, 0)
    if clock.memory["a"] is None:
        pytest.skip("this system has no /proc/self/clear_refs")
    assert clock.memory["a"] == pytest.approx(2**26, rel=0.1)
    assert clock.memory["b"] < 2**22


def test_published_times():
    assert luo2025_time.published(luo2025_scenes.NONE, (2048, 4096)) == {
        "conventional_pga": 0.1945,
        "adaptive_pga": 0.1985,
        "pga_2d": 0.2701,
    }
    assert luo2025_time.published(luo2025_scenes.NONE, (4096, 2048)) == {}


def test_detections_are_those_of_the_library():
    image = luo2025_studies.made(luo2025_scenes.FEW, 3, SHAPE).image
    points = detect.coalesce(detect.strongest_samples(image, 5), (4, 4))
    cells = [(int(p["azimuth"]), int(p["range"])) for p in points if 11 <= p["azimuth"] < 245]
    ratio = luo2025_studies.over_clutter(image)["intensity"][[11 <= p["azimuth"] < 245 for p in points]]
    tested = detect.cfar_1d_at(image, cells, false_alarm_probability=luo2025_studies.false_alarm_probability(4.0), reference=8, guard=3)
    np.testing.assert_allclose(tested["intensity"] / tested["clutter"], ratio, rtol=1e-5)
    np.testing.assert_array_equal(tested["detected"], ratio > 4.0)


def test_false_alarm_probabilities_are_the_papers():
    """Of intensities, though the paper compares amplitudes [Luo2025, table 2]."""
    found = [100 * luo2025_studies.false_alarm_probability(mu) for mu in luo2025_studies.MU]
    np.testing.assert_allclose(found, [6.4, 4.2, 2.8, 1.9, 1.3], atol=0.06)


def test_response_of_a_sinc():
    """Band 0.83 of the spectrum: side lobe 13.26 dB below the peak, which lies between two pixels."""
    spectrum = np.where(luo2025_scenes.inside(512, 0.83), np.exp(-2j * np.pi * np.arange(512) * 100.4 / 512), 0.0)
    image = np.fft.ifft(np.fft.ifftshift(spectrum))[:, None].astype(np.complex64)
    found = luo2025_studies.response(image, 100, 0)
    assert found["ratio_db"] == pytest.approx(13.26, abs=0.1), "16 points a pixel"


def test_means_of_gates():
    assert luo2025_studies.means(np.array([2.0, 8.0, 4.0, 2.0]), 2) == (6.0, 2.0)
    assert luo2025_studies.means(np.full(4, 3.0), 1) == (3.0, 3.0), "no ratio is too small"


def test_studies_print_and_draw(tmp_path, monkeypatch):
    monkeypatch.setattr(luo2025_studies, "KS", (256, 128, 32, 4, 1))
    monkeypatch.setattr(luo2025_studies, "ETAS", (1.0, 2.7))
    result = luo2025_studies.run(shape=(128, 160), seed=3, threads=1)
    cases = {row["case"] for row in result.rows}
    assert cases == {case for case, *_ in luo2025_studies.STUDIES.values()}
    paths = luo2025_studies.draw(result, tmp_path)
    assert len(paths) == 6 and all(path.stat().st_size > 10000 for path in paths)
