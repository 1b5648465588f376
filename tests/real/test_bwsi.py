"""The rail recording: the offset between the clocks of radar and motion capture, path weights, and what one phase per pulse can add."""

import dataclasses

import numpy as np
import pytest

import sarfocus
from sarfocus.cli import main
from sarfocus.focusing import form_image
from sarfocus.io import read, read_bwsi
from sarfocus.motion import along_path, synchronised, with_time_offset

# A few strong points in a scene of a few metres: a narrow window, and only what stands out. Not tuned on the reflectors.
FEW_POINTS = {"coarse_windows": (1 / 16, 1 / 16), "coarse_points": 10, "minimum_contrast": 40.0}
SCENE = sarfocus.ImageGrid.plane((0.5, -5.5, 0.038), (0.03, 0.0, 0.0), (0.0, 0.03, 0.0), (134, 267))


@pytest.fixture(scope="module")
def file(data_directory):
    path = data_directory / "bwsi" / "rail_team6_trial6.npz"
    if not path.exists():
        pytest.skip(f"no BWSI rail recording in {data_directory}")
    return path


@pytest.fixture(scope="module")
def rail(file):
    return read(file)


@pytest.fixture(scope="module")
def placed(rail):
    return synchronised(rail, SCENE)


def peaks(history):
    """Level of both reflectors, dB: the brightest of 5 mm pixels within 0.4 m."""
    out = []
    for centre in np.asarray(history.metadata["reflectors"]):
        grid = sarfocus.ImageGrid.plane(centre - (0.4, 0.4, 0.0), (0.005, 0.0, 0.0), (0.0, 0.005, 0.0), (161, 161))
        out.append(20 * np.log10(np.abs(form_image(history, grid).data).max()))
    return np.array(out)


def delayed(path, metres):
    """Echoes that come `metres` later: envelope and carrier."""
    cycles = np.fft.fftfreq(path.data.shape[1], path.range_spacing) + 2 / path.wavelength
    spectrum = np.fft.fft(path.data, axis=1) * np.exp(-2j * np.pi * cycles * metres[:, None])
    return dataclasses.replace(path, data=np.fft.ifft(spectrum, axis=1).astype(np.complex64))


def turned(path, phase):
    return dataclasses.replace(path, data=(path.data * np.exp(-1j * phase)[:, None]).astype(np.complex64))


def smooth_error(n_pulse, seed):
    """Seven cosines along the aperture, their amplitudes as one over their order; no line, RMS 1."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, n_pulse)
    out = sum(rng.standard_normal() / k * np.cos(np.pi * k * s + rng.uniform(0, 2 * np.pi)) for k in range(2, 9))
    out -= np.polyval(np.polyfit(s, out, 1), s)
    return out / out.std()


def gpga(path, **options):
    arguments = {name: getattr(path, name) for name in ("range_start", "range_spacing", "wavelength")}
    return sarfocus.gpga(path.data, path.positions, SCENE, **arguments, **options)


def test_time_offset_sharpens_both_reflectors(rail, placed):
    moved, found = placed
    assert found.status is sarfocus.TimeOffsetStatus.converged, found.reason
    assert found.held_out_gain > 3 * found.held_out_noise
    gain = peaks(along_path(moved)) - peaks(along_path(rail))
    # Measured: 0.493 and 0.161 dB. The offset is known to 3 ms or so, which costs (3 / 28)^2, a hundredth, of what 28 ms gain; pixels of
    # 5 mm in a response of 85 mm miss its peak by 0.02 dB at most.
    assert (gain > np.array([0.493, 0.161]) - 0.03).all(), gain


def test_every_start_ends_at_the_same_offset(rail, placed):
    for start, least in ((9.15, (8.2, 5.3)), (9.40, (8.4, 6.1))):  # dB; measured 8.26, 5.40 and 8.43, 6.21
        begun = with_time_offset(rail, start)
        moved, found = synchronised(begun, SCENE)
        assert found.status is sarfocus.TimeOffsetStatus.converged, found.reason
        # The grids of the search are multiples of a 27th of 25 ms apart, 50 ms and 6 steps: the same to rounding, or one parabola apart.
        assert found.offset == pytest.approx(placed[1].offset, abs=1e-3)
        assert found.offset_std < 0.005
        gain = peaks(along_path(moved)) - peaks(along_path(begun))
        assert (gain > least).all(), gain


def test_path_weights_beat_equal_ones(placed):
    """Of the pulses of the moving platform: weighted by their path, the reflectors stand out more from the scene."""
    path = along_path(placed[0])
    recorded = placed[0]
    moving = sarfocus.path_weights(recorded.positions, minimum_step=recorded.track.minimum_step) > 0
    equal = dataclasses.replace(path, data=recorded.data[moving])
    weighted, plain = (peaks(x) - 20 * np.log10(np.median(np.abs(form_image(x, SCENE).data))) for x in (path, equal))
    assert (weighted > plain).all(), weighted - plain


def test_untouched_data_come_to_no_harm(placed):
    path = along_path(placed[0])
    before = peaks(path)
    for options in ({}, FEW_POINTS):
        result = gpga(path, **options)
        assert (peaks(turned(path, result.phase_error)) - before > -0.05).all(), result.summary()
    # Even unjudged: with few points the estimate is a small one.
    result = gpga(path, **FEW_POINTS, do_no_harm=False)
    assert (peaks(turned(path, result.phase_error)) - before > -0.05).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("millimetres", "as_delay"), [(6, True), (12, True), (6, False)])
def test_injected_errors_come_off(placed, seed, millimetres, as_delay):
    """An error of 1 to 2 rad RMS that all pulses share comes off: as a phase, or as the delay that it is."""
    path = along_path(placed[0])
    clean = peaks(path)
    error = 1e-3 * millimetres * smooth_error(len(path.data), seed)
    spoiled = delayed(path, error) if as_delay else turned(path, 4 * np.pi / path.wavelength * error)
    assert (peaks(spoiled) - clean < -3.0).all()
    # Unjudged: two strong scatterers don't bear each other out (each has an error of its own left), so the decision hands the data back.
    result = gpga(spoiled, **FEW_POINTS, do_no_harm=False)
    assert (np.abs(peaks(turned(spoiled, result.phase_error)) - clean) < 0.5).all(), result.summary()


def test_command_line_estimates_the_offset_first(file, tmp_path, capfd):
    target = tmp_path / "x.h5"
    assert main(["autofocus", str(file), "-o", str(target), "--spacing", "0.04", "--json"]) == 0
    out = capfd.readouterr().out
    image = read(target)
    found = image.metadata["autofocus"]["time_offset"]
    assert '"time_offset"' in out
    assert (found["recorded"], found["status"]) == (9.25, "converged")
    assert found["offset"] == pytest.approx(9.278, abs=1e-3)
    assert np.abs(image.data).max() > np.abs(image.arrays["before"]).max()
    assert main(["report", str(target), "-o", str(tmp_path / "x.html")]) == 0
    assert "+27.8 ms" in capfd.readouterr().out, "the report does not call the image the input"
    assert main(["autofocus", str(file), "-o", str(target), "--spacing", "0.04", "--no-time-offset"]) == 0
    assert "time_offset" not in read(target).metadata["autofocus"]


def test_an_offset_beyond_the_motion_capture_is_refused(file):
    with pytest.raises(ValueError, match="covers"):
        read_bwsi(file, time_offset=11.0)
