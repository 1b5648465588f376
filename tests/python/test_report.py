"""The page and its figures: self-contained, complete, and honest about what is missing."""

import html.parser
import io
import json
import re

import numpy as np
import pytest
from matplotlib.image import imread
from pydantic import ValidationError

import sarfocus
from sarfocus import scenes, strip_scene
from sarfocus.cli import main
from sarfocus.io import Image, read
from sarfocus.report import Report, Section, Table, figures, render, write_page
from sarfocus.report.build import build


class Checker(html.parser.HTMLParser):
    """Collects addresses and looks for tags that are not closed."""

    VOID = frozenset({"meta", "img", "br", "hr", "link", "input"})

    def __init__(self):
        super().__init__()
        self.addresses, self.open = [], []

    def handle_starttag(self, tag, attrs):
        self.addresses += [value for name, value in attrs if name in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def checked(page):
    checker = Checker()
    checker.feed(page)
    checker.close()
    assert checker.open == []
    return checker.addresses


def image_with_points(seed=1, shape=(160, 140)):
    generator = np.random.default_rng(seed)
    data = 0.01 * (generator.standard_normal(shape) + 1j * generator.standard_normal(shape))
    rows, columns = np.arange(shape[0])[:, None], np.arange(shape[1])[None, :]
    for i, j in ((40.0, 50.0), (80.3, 100.2), (120.0, 60.0)):
        data += np.sinc((rows - i) / 2) * np.sinc((columns - j) / 2)
    return data.astype(np.complex64)


def test_page_needs_nothing_else():
    result = Image(image_with_points(), azimuth_spacing=0.2, range_spacing=0.3, arrays={"before": image_with_points(2)})
    page = render(build(result, title="A title", lead="A lead."))
    addresses = checked(page)
    assert addresses and all(address.startswith("data:image/png;base64,") for address in addresses)
    assert "http" not in page and "@import" not in page and "<script" not in page


def test_text_is_escaped():
    page = render(Report(title="<script>alert(1)</script>", lead="a & b", verdict="x < y", sections=[Section(title="T", text=["<b>"])]))
    assert "<script>" not in page and "<b>" not in page
    checked(page)


def test_unknown_fields_are_refused():
    with pytest.raises(ValidationError):
        Table(caption="", head=[], rows=[], colour="red")


def test_result_without_truth_or_before():
    """A bare image gives a page with what there is, and says that no autofocus was run."""
    page = build(Image(image_with_points()), title="T", lead="L")
    assert page.headline == []
    assert "No autofocus was run." in page.verdict
    assert [section.title for section in page.sections] == ["The image", "Point responses", "Figures"]


def test_result_without_points():
    generator = np.random.default_rng(4)
    noise = (generator.standard_normal((96, 96)) + 1j * generator.standard_normal((96, 96))).astype(np.complex64)
    page = build(Image(noise, arrays={"before": noise}), title="T", lead="L")
    assert "Point responses" not in [section.title for section in page.sections]
    checked(render(page))


def test_phase_with_gaps_is_drawn():
    """Where no aperture reaches, the standard deviation is nan."""
    phase, deviation = np.linspace(-1, 1, 160), np.full(160, 0.1)
    deviation[:20] = np.nan
    arrays = {"before": image_with_points(2), "phase_error": phase, "phase_std": deviation}
    titles = [section.title for section in build(Image(image_with_points(), arrays=arrays), title="T", lead="L").sections]
    assert "Phase error" in titles


def test_strip_without_truth_or_points():
    """Two bright points, one seam; no targets are known: no displacements are claimed."""
    geometry = sarfocus.StripmapGeometry(
        wavelength=0.03, prf=360.0, velocity=120.0, slant_range=3000 + 0.5 * np.arange(140), doppler_bandwidth=300.0
    )
    seams = {"first": [0], "second": [1], "weight": [1.0], "residual": [0.01]}
    points = np.zeros(2, dtype=[("azimuth", "f8"), ("range", "f8"), ("shift", "f8")])
    points["azimuth"], points["range"] = (40, 80), (50, 100)
    arrays = {"before": image_with_points(2), "points": points}
    metadata = {"autofocus": {"diagnostics": {"strip": {"seams": seams, "segments": 1}}}}
    strip = Image(image_with_points(), geometry=geometry, azimuth_spacing=0.33, range_spacing=0.5, metadata=metadata, arrays=arrays)
    titles = [section.title for section in build(strip, title="T", lead="L").sections]
    assert titles[:2] == ["The strip", "Its points"]
    assert "Seams" in titles and "Where the targets lie" not in titles


def test_images_share_one_scale():
    """The same pixel values give the same grey in both panels, though one image is ten times weaker."""
    strong = np.full((40, 40), 1.0 + 0j)
    weak = np.full((40, 40), 0.1 + 0j)
    strong[5:10, 5:10] = weak[5:10, 5:10] = 0.01
    picture = imread(io.BytesIO(figures.png(figures.image_figure({"a": strong, "b": weak}, (1.0, 1.0)))))
    grey = picture[..., :3].mean(axis=2)
    level = 1.0 - 20.0 / figures.DYNAMIC_RANGE_DB
    assert np.isclose(grey, level, atol=0.02).sum() > 1000, "the weak image lies 20 dB down"
    assert picture.shape[1] > 600


def test_writing_a_page_replaces_it_whole(tmp_path):
    report = Report(title="T", lead="L", verdict="V")
    write_page(tmp_path / "x.html", report)
    assert (tmp_path / "x.html").read_text(encoding="utf-8") == render(report)
    assert len(list(tmp_path.iterdir())) == 1


def test_demo_of_a_strip(tmp_path, capfd, monkeypatch):
    """A shorter strip, displaced points among them: they come back to their places, and the page says so with the figures of the run."""
    for name, value in {"N_AZIMUTH": 1536, "N_RANGE": 96, "RANGE_START": 3000.0, "N_POINT": 24, "BUILDINGS": ((0.3, 0.6),)}.items():
        monkeypatch.setattr(strip_scene, name, value)
    assert main(["demo", "-o", str(tmp_path / "demo"), "--json"]) == 0
    captured = capfd.readouterr()
    assert captured.err == ""
    figures_of_run = json.loads(captured.out)
    assert figures_of_run["scene"] == "strip" and figures_of_run["status"] == "converged"
    before, after = figures_of_run["Displacement of targets (m), RMS"].split(" → ")
    # 24 points 34 dB over the clutter: a residual slope of 0.03 rad over an aperture of 350 samples is a hundredth of a metre.
    assert float(before) > 0.5
    assert float(after) < 0.03
    page = (tmp_path / "demo" / "report.html").read_text(encoding="utf-8")
    assert len(checked(page)) == 6, "strip, points, phase, displacements, seams, point responses"
    assert figures_of_run["verdict"] in re.sub(r"\s+", " ", page)
    result = read(tmp_path / "demo" / "result.h5")
    assert result.metadata["autofocus"]["diagnostics"]["strip"]["segments"] == 1
    residual = result.arrays["phase_error"] - result.arrays["true_phase_error"]
    index = np.arange(len(residual))
    residual -= np.polynomial.Polynomial.fit(index, residual, 1)(index)
    assert np.sqrt(np.mean(residual**2)) < 0.15, "the bound for 40 points at 25 dB; here fewer and stronger ones"
    assert main(["report", str(tmp_path / "demo" / "result.h5"), "-o", str(tmp_path / "again.html"), "--json"]) == 0


def test_demo_of_a_spotlight_scene(tmp_path, capfd, monkeypatch):
    """The whole of it on a smaller scene: the error goes, and the page says so with the figures of the run."""
    monkeypatch.setattr(scenes, "CLUTTER_PER_CELL", 0.1)
    monkeypatch.setattr(scenes, "SCENE_SIZE", (52.0, 52.0))
    assert main(["demo", "--scene", "spotlight", "-o", str(tmp_path / "demo"), "--json"]) == 0
    captured = capfd.readouterr()
    assert captured.err == ""
    figures_of_run = json.loads(captured.out)
    assert figures_of_run["status"] == "converged"
    page = (tmp_path / "demo" / "report.html").read_text(encoding="utf-8")
    assert len(checked(page)) == 3, "images, phase, point responses"
    assert figures_of_run["verdict"] in re.sub(r"\s+", " ", page)
    assert "spotlight" in page
    result = read(tmp_path / "demo" / "result.h5")
    residual = result.arrays["phase_error"] - result.arrays["true_phase_error"]
    index = np.arange(len(residual))
    residual -= np.polynomial.Polynomial.fit(index, residual, 1)(index)
    # Eight points 32 dB over the clutter in the image: 5.5 dB a pulse, for which the bound is 0.13 rad before windowing.
    assert np.sqrt(np.mean(residual**2)) < 0.15
    assert main(["report", str(tmp_path / "demo" / "result.h5"), "-o", str(tmp_path / "again.html"), "--json"]) == 0


def decided(**diagnostics):
    autofocus = {"method": "adaptive_pga", "status": "converged", "diagnostics": diagnostics}
    page = build(Image(image_with_points(), metadata={"autofocus": autofocus}), title="T", lead="L")
    return {section.title: section for section in page.sections}


def cell(value, detected):
    return {"azimuth": 40, "range": 50, "extent": 4, "value": value, "clutter": 1.0, "threshold": 20.0, "detected": detected}


def part(first, gates, strong):
    return {"first": first, "count": 512, "gates": gates, "mean_strong": strong, "mean_rest": 1.0, "points": gates}


def test_decisions_of_adaptive_pga_are_explained():
    adaptive = {"cells": [cell(100.0, True), cell(10.0, False)], "strong_points": True, "first_denoised": 0, "denoised": 0, "eta": 2.7}
    adaptive["sub_apertures"] = [part(0, 128, 3.0), part(256, 4, 5.0), part(512, 0, 2.0)]
    sections = decided(adaptive=adaptive)
    gate = sections["Are there strong points?"]
    assert "1 of the 2 strongest cells" in gate.text[0]
    assert gate.table.rows[0][1:] == ["4", "20.0", "13.0", "strong point"]
    text = sections["Strong range gates of every sub-aperture"].text[0]
    assert "k = 4 to 128" in text and "In 1 of them" in text
    gate = decided(adaptive=adaptive | {"amplitudes": True})["Are there strong points?"]
    assert gate.table.rows[0][1:] == ["4", "40.0", "26.0", "strong point"]


def test_a_scene_without_strong_points_says_which_gates_were_denoised():
    adaptive = {"cells": [cell(10.0, False)], "strong_points": False, "first_denoised": 96, "denoised": 16, "eta": 2.7, "sub_apertures": []}
    sections = decided(adaptive=adaptive)
    assert "range gates 96 to 111" in sections["Are there strong points?"].text[0]
    assert "Strong range gates of every sub-aperture" not in sections


def trial(method, gain, points, chosen):
    judged = {"held_out_gain_db": gain, "held_out_std_db": 0.2, "held_out_points": points, "held_out_entropy": -0.1}
    return {"method": method, "status": "converged", "seconds": 0.5, "chosen": chosen, "reason": "because"} | judged


def test_methods_tried_are_listed_with_why():
    sections = decided(trials=[trial("pga", 3.0, 20, True), trial("minimum_entropy", None, 0, False)])
    table = sections["Which method, and why"].table
    assert "Chosen: pga." in sections["Which method, and why"].text[0]
    assert table.rows[0] == ["pga", "+3.00 ± 0.20", "20", "-0.1000", "0.50", "because"]
    assert table.rows[1][1] == "–"
    assert sections["Gain of points that were held back"].picture
    assert "Gain of points that were held back" not in decided(trials=[trial("pga", None, 0, True)])


def test_why_a_phase_was_not_applied():
    score = {"entropy_before": 9.0, "entropy_after": 9.1, "held_out_gain": -0.1, "held_out_noise": 0.05, "point_gain_db": -0.2}
    sections = decided(score=score | {"improved": False, "reason": "entropy did not fall"})
    assert sections["Why the phase was not applied"].text == ["Entropy did not fall."]
