"""The readers on measured data: what is known of the collections must come out of them."""

import dataclasses
import json

import numpy as np
import pytest
import scipy.io

from sarfocus.cli import main
from sarfocus.focusing import form_image
from sarfocus.grids import default_grid
from sarfocus.io import read, read_bwsi, write
from sarfocus.motion import along_path

SPEED_OF_LIGHT = 299792458.0


@pytest.fixture(scope="module")
def gotcha_files(data_directory):
    files = [data_directory / "gotcha" / f"data_3dsar_pass1_az00{degree}_HH.mat" for degree in (1, 2)]
    if not all(file.exists() for file in files):
        pytest.skip(f"no Gotcha files in {data_directory}")
    return files


@pytest.fixture(scope="module")
def rail(data_directory):
    file = data_directory / "bwsi" / "rail_team6_trial6.npz"
    if not file.exists():
        pytest.skip(f"no BWSI rail recording in {data_directory}")
    return file


def pixel_of(image, point):
    """Fractional pixel of a point of the plane of the image."""
    origin, azimuth_step, range_step = np.asarray(image.grid.vectors)
    offset = np.asarray(point) - origin
    return offset @ azimuth_step / (azimuth_step @ azimuth_step), offset @ range_step / (range_step @ range_step)


def strongest_near(image, point, radius):
    """Position and amplitude of the strongest pixel within `radius` metres of a point."""
    distance = np.linalg.norm(image.grid.positions() - np.asarray(point), axis=2)
    level = np.where(distance <= radius, np.abs(image.data), 0.0)
    place = np.unravel_index(np.argmax(level), level.shape)
    return np.asarray(image.grid.position(*place)), level[place]


def test_gotcha_is_one_aperture(gotcha_files):
    history = read(gotcha_files)
    assert history.data.shape[0] == 234
    assert history.wavelength == pytest.approx(SPEED_OF_LIGHT / 9.599e9, rel=1e-3)
    bearing = np.degrees(np.arctan2(history.positions[:, 1], history.positions[:, 0]))
    steps = np.diff(bearing)
    assert steps.min() > 0, "flown in one sense"
    # The degrees join without a gap: the step across the seam is like the others, as far as positions in single precision tell.
    assert steps[116] == pytest.approx(np.median(steps), rel=0.01)


def test_gotcha_image_matches_the_matched_filter(gotcha_files):
    """Pixels of the formed image against the sum over frequencies and pulses that the collection's documentation gives."""
    history = read(gotcha_files)
    image = form_image(history, default_grid(history, centre=(-15.53, 21.63, 0.0), size=(4.0, 4.0), spacing=(0.2, 0.2)))
    places = [(i, j) for i in range(0, 20, 3) for j in range(0, 20, 3)]
    expected = np.zeros(len(places), complex)
    for file in gotcha_files:
        struct = scipy.io.loadmat(file, squeeze_me=True)["data"]
        fp, freq, x, y, z = (np.asarray(struct[name].item(), dtype=np.complex128) for name in ("fp", "freq", "x", "y", "z"))
        freq = np.linspace(freq[0].real, freq[-1].real, len(freq))[:, None]
        antenna = np.stack([x, y, z], axis=1).real
        reference = np.linalg.norm(antenna, axis=1)  # r0 without its rounding to single precision
        for n, place in enumerate(places):
            distance = np.linalg.norm(antenna - image.grid.position(*place), axis=1)
            expected[n] += np.sum(fp * np.exp(4j * np.pi * freq * (distance - reference) / SPEED_OF_LIGHT)) / len(freq)
    # A phase common to all pixels is left open.
    found = np.array([image.data[place] for place in places])
    found *= np.exp(1j * np.angle(np.vdot(found, expected)))
    error = np.linalg.norm(found - expected) / np.linalg.norm(expected)
    assert error < 10 ** (-55 / 20), "interpolation errs by less than -68 dB"


def test_gotcha_reference_ranges_lose_their_rounding(gotcha_files):
    """Every profile starts at a fixed distance from the scene centre, whose range is computed from the positions as they are given."""
    history = read(gotcha_files[:1])
    recorded = scipy.io.loadmat(gotcha_files[0], squeeze_me=True)["data"]["r0"].item().astype(float)
    used = np.linalg.norm(history.positions, axis=1)
    np.testing.assert_allclose(history.range_start - history.range_start[0], used - used[0], rtol=0, atol=1e-9)
    assert np.abs(used - recorded).max() < 2e-3, "they are the recorded ones to the rounding of single precision at 10 km"


def test_gotcha_reflectors(gotcha_files):
    history = read(gotcha_files)
    for known in ((-16.0, 21.0, 0.0), (-28.0, 38.5, 0.0)):
        image = form_image(history, default_grid(history, centre=known, size=(12.0, 12.0), spacing=(0.15, 0.15)))
        found, level = strongest_near(image, known, 2.0)
        assert level > 20 * np.median(np.abs(image.data)), "26 dB over the neighbourhood"
        assert np.linalg.norm(found - known) < 1.0, "the places are given to a metre or so"


def test_gotcha_survives_our_own_format(gotcha_files, tmp_path):
    history = read(gotcha_files)
    for name in ("x.npz", "x.h5"):
        write(tmp_path / name, history)
        back = read(tmp_path / name)
        np.testing.assert_array_equal(back.data, history.data)
        np.testing.assert_array_equal(back.range_start, history.range_start)
        np.testing.assert_array_equal(back.positions, history.positions)


def test_truncated_gotcha_file(gotcha_files, tmp_path, capfd):
    cut = tmp_path / "cut.mat"
    cut.write_bytes(gotcha_files[0].read_bytes()[:200_000])
    assert main(["form", str(cut), "-o", str(tmp_path / "x.npz")]) == 2
    captured = capfd.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1 and "cut.mat" in captured.err


def test_form_from_the_command_line(gotcha_files, tmp_path, capfd):
    target = tmp_path / "x.h5"
    assert main(["form", *map(str, gotcha_files), "-o", str(target), "--size", "30", "--spacing", "0.3", "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["shape"] == [100, 100]
    assert read(target).data.shape == (100, 100)


def test_rail_reflectors_stand_where_they_were_surveyed(rail):
    history = read(rail)
    reflectors = np.asarray(history.metadata["reflectors"])
    assert len(history.data) == 607, "all pulses are kept"
    assert 0 < len(along_path(history).data) < 607, "the rests at both ends stay out of the image"
    image = form_image(history, default_grid(history, spacing=(0.04, 0.04)))
    for reflector in reflectors:
        found, level = strongest_near(image, reflector, 0.6)
        assert level > 30 * np.median(np.abs(image.data)), "30 dB over the scene"
        # The fitted bias is loose (0.2 to 0.4 m) and the resolution 0.1 to 0.2 m.
        assert np.linalg.norm((found - reflector)[:2]) < 0.3


def test_rail_sharpens_without_the_rests(rail):
    """The reflectors stand out more where pulses count by the path they stand for than where all count the same."""
    weighted = read_bwsi(rail)
    everything = dataclasses.replace(weighted, track=None)
    contrasts = []
    for history in (everything, weighted):
        image = form_image(history, default_grid(weighted, spacing=(0.04, 0.04)))
        _, level = strongest_near(image, history.metadata["reflectors"][0], 0.6)
        contrasts.append(level / np.median(np.abs(image.data)))
    assert contrasts[1] > 5 * contrasts[0]


def test_walk_has_no_trajectory(data_directory, capfd, tmp_path):
    file = data_directory / "bwsi" / "walk_sculpture_trial3.npz"
    if not file.exists():
        pytest.skip(f"no BWSI walk in {data_directory}")
    history = read(file)
    assert history.positions is None
    assert len(history.data) == 710
    assert main(["form", str(file), "-o", str(tmp_path / "x.npz")]) == 2
    assert "trajectory" in capfd.readouterr().err


def test_sentinel_excerpt_is_tops_and_no_stripmap(data_directory):
    files = sorted((data_directory / "sentinel1").glob("*.tiff"))
    if not files:
        pytest.skip(f"no Sentinel-1 excerpt in {data_directory}")
    image = read(files[0])
    assert image.data.shape == (601, 1401)
    assert image.geometry is None and image.grid is None
    assert image.metadata["acquisition"].startswith("TOPS") and image.metadata["mode"] == "IW"
    assert (image.azimuth_spacing, image.range_spacing) == (pytest.approx(13.89852), pytest.approx(2.329562)), "of the annotation"
    assert image.metadata["wavelength"] == pytest.approx(SPEED_OF_LIGHT / 5.405e9)
    np.testing.assert_array_equal(image.data, image.data.real.astype(np.int16) + 1j * image.data.imag.astype(np.int16))
    land, sea = np.abs(image.data[:200]), np.abs(image.data[420:])
    assert np.median(land) > 5 * np.median(sea), "the coast runs along the middle; lines are azimuth"
