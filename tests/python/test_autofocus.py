"""autofocus as Python sees it: which method is chosen and why, what comes back unchanged, and a sample of the do-no-harm experiment."""

import numpy as np
import pytest

import sarfocus
from sarfocus import autofocus, method_names
from sarfocus.experiments import do_no_harm


def image_of(points: int, *, shape: tuple[int, int] = (128, 96), peak_db: float = 33.0, seed: int = 0, error: float = 0.0):
    """Points in speckle of power one, one gate in five, under a quadratic error on the azimuth spectrum."""
    rng = np.random.default_rng(seed)
    image = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    for p in range(points):
        image[(17 + 31 * p) % shape[0], 2 + (5 * p) % (shape[1] - 4)] += 10 ** (peak_db / 20)
    spectrum = np.fft.fftshift(np.fft.fft(image, axis=0), axes=0) * np.exp(1j * error * np.linspace(-1, 1, shape[0]) ** 2)[:, None]
    return np.fft.ifft(np.fft.ifftshift(spectrum, axes=0), axis=0).astype(np.complex64)


def test_the_trials_say_what_was_chosen_and_why():
    image = image_of(18, error=6.0)
    result = autofocus(image)
    trials = result.diagnostics["trials"]
    assert [trial["method"] for trial in trials] == method_names(strip=False)
    assert [trial["method"] for trial in trials if trial["chosen"]] == [result.diagnostics["method"]]
    assert all(trial["reason"] for trial in trials)
    assert sarfocus.quality.entropy(result.image) < sarfocus.quality.entropy(image)
    assert all(trial["method"] in result.summary() for trial in trials)


@pytest.mark.parametrize("points", [0, 1, 18])
def test_an_image_in_focus_comes_back_itself(points):
    image = image_of(points)
    result = autofocus(image)
    assert result.image is image
    assert not result.phase_error.any()
    assert result.diagnostics["score"]["reason"]


def test_in_place_and_out():
    image = image_of(18, error=6.0)
    expected = autofocus(image, methods=["pga"]).image
    out = np.empty_like(image)
    assert autofocus(image, methods=["pga"], out=out).image is out
    np.testing.assert_array_equal(out, expected)
    assert autofocus(image, methods=["pga"], out=image).image is image
    np.testing.assert_array_equal(image, expected)


def test_a_method_by_name_is_that_method():
    image = image_of(18, error=6.0)
    np.testing.assert_array_equal(autofocus(image, method="pga").image, sarfocus.pga(image).image)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "magic"}, "adaptive_pga"),
        ({"method": "spga_linear"}, "without stripmap geometry"),
        ({"methods": ["spga"]}, "methods: expected some of pga"),
        ({"method": "pga", "methods": ["pga"]}, "none beside"),
        ({"threads": -1}, "threads"),
    ],
)
def test_refusals(options, message):
    with pytest.raises(ValueError, match=message):
        autofocus(image_of(3), **options)


def test_nan_and_cancel():
    image = image_of(3)
    with pytest.raises(sarfocus.Cancelled):
        autofocus(image, progress=lambda *_: False)
    image[3, 4] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"\[3, 4\]"):
        autofocus(image)


@pytest.mark.parametrize("number", range(len(do_no_harm.KINDS)))
def test_no_harm(number):
    """One of every kind of scene, without an error and with one; of the whole experiment, `sarfocus reproduce do-no-harm`."""
    for error in (False, True):
        scene = do_no_harm.make(do_no_harm.SEED, number, error)
        outcome = do_no_harm.focus(scene, "auto")
        assert outcome.verdict != "worse", f"{scene.kind}: {outcome}"
