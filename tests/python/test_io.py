"""Readers and writers: what is written comes back, what is damaged is refused in one line, nothing is lost when writing fails."""

import dataclasses
import json
import os
import stat

import h5py
import numpy as np
import pytest
import scipy.io

import sarfocus
from reference.histories import history
from sarfocus import ImageGrid, NumericalError, ShapeError, StripmapGeometry
from sarfocus.io import FormatError, Image, PhaseHistory, layout, read, read_bwsi, read_gotcha, write
from sarfocus.motion import along_path, with_time_offset

CONTAINERS = (".npz", ".h5", ".hdf5")


def picture(shape=(6, 5), seed=1):
    generator = np.random.default_rng(seed)
    return (generator.standard_normal(shape) + 1j * generator.standard_normal(shape)).astype(np.complex64)


def plane(shape=(6, 5)):
    return ImageGrid.plane((1.0, 2.0, 3.0), (0.0, 0.25, 0.0), (0.5, 0.0, 0.0), shape)


def assert_one_line(error):
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", CONTAINERS)
@pytest.mark.parametrize("compress", [False, True])
def test_phase_history_round_trip(tmp_path, suffix, compress):
    written = history(note="quay", scene_centre=[0.5, -1.0, 2.0])
    write(tmp_path / f"x{suffix}", written, compress=compress)
    back = read(tmp_path / f"x{suffix}")
    assert isinstance(back, PhaseHistory)
    np.testing.assert_array_equal(back.data, written.data)
    assert back.data.dtype == np.complex64
    np.testing.assert_array_equal(back.positions, written.positions)
    assert (back.range_start, back.range_spacing, back.wavelength) == (written.range_start, written.range_spacing, written.wavelength)
    assert back.metadata == written.metadata


@pytest.mark.parametrize("suffix", CONTAINERS)
def test_bistatic_and_range_start_per_pulse(tmp_path, suffix):
    base = history()
    start = base.range_start + 0.01 * np.arange(len(base.data))
    written = PhaseHistory(base.data, (base.positions, base.positions + 3.0), start, base.range_spacing, base.wavelength)
    write(tmp_path / f"x{suffix}", written)
    back = read(tmp_path / f"x{suffix}")
    assert isinstance(back.positions, tuple)
    np.testing.assert_array_equal(back.positions[1], base.positions + 3.0)
    np.testing.assert_array_equal(back.range_start, start)
    np.testing.assert_allclose(back.phase_centres, base.positions + 1.5, rtol=0, atol=1e-12)


@pytest.mark.parametrize("suffix", CONTAINERS)
def test_history_without_trajectory(tmp_path, suffix):
    base = history()
    write(tmp_path / f"x{suffix}", PhaseHistory(base.data, None, 1.0, 0.5, 0.03))
    back = read(tmp_path / f"x{suffix}")
    assert back.positions is None
    with pytest.raises(ValueError, match="trajectory"):
        _ = back.phase_centres


@pytest.mark.parametrize("suffix", CONTAINERS)
@pytest.mark.parametrize("kind", ["plane", "polar", "points"])
def test_image_round_trip_with_grid(tmp_path, suffix, kind):
    polar = ImageGrid.polar(
        (0, 0, 0), (1, 0, 0), (0, 1, 0), range_start=100.0, range_spacing=0.5, angle_start=-0.1, angle_spacing=0.01, shape=(6, 5)
    )
    grid = {"plane": plane(), "polar": polar, "points": ImageGrid.from_points(polar.positions())}[kind]
    points = np.array([(1.5, 2.5, 0.1)], dtype=[("azimuth", "f8"), ("range", "f8"), ("weight", "f8")])
    arrays = {"before": picture(seed=3), "phase_error": np.linspace(0, 1, 6), "points": points}
    write(tmp_path / f"x{suffix}", Image(picture(), grid=grid, metadata={"a": 1, "b": [1.5, None], "c": {"d": "é"}}, arrays=arrays))
    back = read(tmp_path / f"x{suffix}")
    np.testing.assert_array_equal(back.data, picture())
    assert back.grid.kind == kind
    np.testing.assert_array_equal(back.grid.positions(), grid.positions())
    assert back.metadata == {"a": 1, "b": [1.5, None], "c": {"d": "é"}}
    assert set(back.arrays) == set(arrays)
    for name, values in arrays.items():
        np.testing.assert_array_equal(back.arrays[name], values)
        assert back.arrays[name].dtype == values.dtype


@pytest.mark.parametrize("suffix", CONTAINERS)
def test_image_round_trip_with_stripmap_geometry(tmp_path, suffix):
    geometry = StripmapGeometry(
        wavelength=0.03, prf=500.0, velocity=120.0, slant_range=5000.0 + 0.5 * np.arange(5), doppler_bandwidth=300.0, doppler_centroid=20.0
    )
    write(tmp_path / f"x{suffix}", Image(picture(), geometry=geometry, azimuth_spacing=0.24, range_spacing=0.5))
    back = read(tmp_path / f"x{suffix}")
    for name in layout.GEOMETRY_FIELDS:
        np.testing.assert_array_equal(getattr(back.geometry, name), getattr(geometry, name))
    assert (back.azimuth_spacing, back.range_spacing) == (0.24, 0.5)


def test_npy_keeps_the_samples(tmp_path):
    write(tmp_path / "x.npy", Image(picture(), grid=plane()))
    back = read(tmp_path / "x.npy")
    np.testing.assert_array_equal(back.data, picture())
    assert back.grid is None
    with pytest.raises(FormatError, match="phase history"):
        write(tmp_path / "y.npy", history())


def test_spacings_come_from_a_plane_grid():
    image = Image(picture(), grid=plane())
    assert (image.azimuth_spacing, image.range_spacing) == (0.25, 0.5)


def test_strided_samples_are_written_as_they_stand(tmp_path):
    whole = picture((12, 10))
    for suffix in (*CONTAINERS, ".npy"):
        write(tmp_path / f"x{suffix}", Image(whole[::2, ::-2]))
        np.testing.assert_array_equal(read(tmp_path / f"x{suffix}").data, whole[::2, ::-2])


def test_hdf5_layout_is_what_the_documentation_says(tmp_path):
    data = np.zeros((1024, 512), dtype=np.complex64)
    data[3, 4] = 1j
    base = history(n_pulse=1024)
    write(tmp_path / "x.h5", PhaseHistory(data, base.positions, 1.0, 0.5, 0.03, {"a": 1}), compress=True)
    with h5py.File(tmp_path / "x.h5") as file:
        assert file["format"].asstr()[()] == "sarfocus"
        assert int(file["version"][()]) == layout.VERSION
        assert file["data"].dtype == np.complex64
        assert file["data"].chunks == (256, 512), "whole rows, 1 MiB"
        assert file["data"].compression == "gzip"
        assert json.loads(file["metadata"].asstr()[()]) == {"a": 1}


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "x.npz"
    write(target, Image(picture()))
    before = target.read_bytes()

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(FormatError, match="No space left") as error:
        write(target, Image(picture(seed=9)))
    assert_one_line(error)
    assert target.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["x.npz"], "no temporary file is left"


def test_interrupted_write_leaves_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "x.h5"
    write(target, Image(picture()))

    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(h5py.Group, "create_dataset", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(target, Image(picture(seed=9)))
    monkeypatch.undo()
    np.testing.assert_array_equal(read(target).data, picture())
    assert [p.name for p in tmp_path.iterdir()] == ["x.h5"]


def test_written_files_have_ordinary_permissions(tmp_path):
    write(tmp_path / "x.npz", Image(picture()))
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE((tmp_path / "x.npz").stat().st_mode) == 0o666 & ~mask


@pytest.mark.parametrize("name", ["x.tif", "x", "missing/x.npz"])
def test_unknown_target_is_refused(tmp_path, name):
    with pytest.raises(FormatError) as error:
        write(tmp_path / name, Image(picture()))
    assert_one_line(error)


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".h5", ".mat"])
def test_missing_file(tmp_path, suffix):
    with pytest.raises(FormatError, match=f"x{suffix}: no such file") as error:
        read(tmp_path / f"x{suffix}")
    assert_one_line(error)


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".h5"])
@pytest.mark.parametrize("keep", [0, 7, 0.5, 0.98])
def test_truncated_file(tmp_path, suffix, keep):
    path = tmp_path / f"x{suffix}"
    write(path, Image(picture((64, 64))))
    content = path.read_bytes()
    path.write_bytes(content[: keep if isinstance(keep, int) else int(keep * len(content))])
    with pytest.raises(FormatError, match=str(path)) as error:
        read(path)
    assert_one_line(error)


def test_flipped_bits_in_hdf5_are_noticed(tmp_path):
    path = tmp_path / "x.h5"
    write(path, Image(picture((512, 512))))
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(FormatError) as error:
        read(path)
    assert_one_line(error)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        (np.zeros((4, 4), np.complex128), "complex64"),
        (np.zeros((4, 4), np.float32), "complex64"),
        (np.zeros((4,), np.complex64), "2 dimensions"),
        (np.zeros((0, 4), np.complex64), "size zero"),
        (np.where(np.eye(4) > 2, 0, np.nan).astype(np.complex64), r"\[0, 0\]"),
    ],
)
def test_bad_bare_images(tmp_path, values, says):
    np.save(tmp_path / "x.npy", values)
    with pytest.raises(FormatError, match=says) as error:
        read(tmp_path / "x.npy")
    assert_one_line(error)


def test_nan_is_reported_with_its_position(tmp_path):
    data = picture()
    data[4, 3] = np.nan + 0j
    np.save(tmp_path / "x.npy", data)
    with pytest.raises(FormatError, match=r"\[4, 3\]"):
        read(tmp_path / "x.npy")
    with pytest.raises(NumericalError, match=r"\[4, 3\]"):
        Image(data)


def test_npy_under_another_name(tmp_path):
    np.save(tmp_path / "x.npy", picture())
    (tmp_path / "x.npy").rename(tmp_path / "x.npz")
    with pytest.raises(FormatError, match="archive"):
        read(tmp_path / "x.npz")


def test_pickled_objects_are_not_loaded(tmp_path):
    np.save(tmp_path / "x.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    np.savez(tmp_path / "x.npz", format=np.array([{"a": 1}], dtype=object))
    for name in ("x.npy", "x.npz"):
        with pytest.raises(FormatError) as error:
            read(tmp_path / name)
        assert_one_line(error)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"version": np.array(layout.VERSION + 1)}, "newer"),
        ({"format": np.array("other")}, "not a sarfocus file"),
        ({"kind": np.array("song")}, "song"),
        ({"metadata": np.array("{")}, "JSON"),
        ({"positions": np.zeros((5, 3))}, r"\(96, 3\)"),
        ({"positions": np.full((96, 3), np.inf)}, "positions"),
        ({"range_start": np.zeros(7)}, "range_start"),
        ({"wavelength": np.array(-1.0)}, "wavelength"),
        ({"range_spacing": np.array(np.nan)}, "range_spacing"),
        ({"data": np.zeros((96, 0), np.complex64)}, "size zero"),
        ({"data": np.zeros((96, 128), np.complex128)}, "complex64"),
    ],
)
def test_fields_that_do_not_fit(tmp_path, change, says):
    np.savez(tmp_path / "x.npz", **(layout.to_fields(history()) | change))
    with pytest.raises(FormatError, match=says) as error:
        read(tmp_path / "x.npz")
    assert_one_line(error)


@pytest.mark.parametrize("gone", ["data", "wavelength", "kind", "version", "metadata", "format"])
def test_missing_fields(tmp_path, gone):
    fields = layout.to_fields(history())
    del fields[gone]
    np.savez(tmp_path / "x.npz", **fields)
    with pytest.raises(FormatError, match=gone) as error:
        read(tmp_path / "x.npz")
    assert_one_line(error)


def test_grid_and_image_must_agree():
    with pytest.raises(ShapeError, match="grid"):
        Image(picture((6, 5)), grid=plane((5, 6)))


def gotcha_struct(n_frequency=32, n_pulse=8):
    generator = np.random.default_rng(4)
    frequency = 9.3e9 + 1.5e6 * np.arange(n_frequency)
    line = {name: np.full(n_pulse, value) for name, value in (("x", 7000.0), ("y", 1.0), ("z", 7000.0), ("r0", 9899.5))}
    line["y"] = np.linspace(0.0, 5.0, n_pulse)
    fp = (generator.standard_normal((n_frequency, n_pulse)) + 1j).astype(np.complex64)
    return {"fp": fp, "freq": frequency.astype(np.float32)[:, None], **{k: v.astype(np.float32)[None, :] for k, v in line.items()}}


def test_joined_gotcha_files_keep_their_order(tmp_path):
    struct = gotcha_struct()
    scipy.io.savemat(tmp_path / "a.mat", {"data": struct})
    scipy.io.savemat(tmp_path / "b.mat", {"data": struct | {"y": struct["y"] + 6.0}})
    joined = read([tmp_path / "a.mat", tmp_path / "b.mat"])
    alone = read_gotcha([tmp_path / "a.mat"])
    assert len(joined.data) == 16
    assert np.all(np.diff(joined.positions[:, 1]) > 0)
    np.testing.assert_array_equal(joined.data[:8], alone.data)


@pytest.mark.parametrize("keep", [0, 60, 0.3, 0.9])
def test_truncated_mat(tmp_path, keep):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"data": gotcha_struct()})
    content = path.read_bytes()
    path.write_bytes(content[: keep if isinstance(keep, int) else int(keep * len(content))])
    with pytest.raises(FormatError, match=r"a\.mat") as error:
        read(path)
    assert_one_line(error)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"fp": np.zeros((32, 8))}, "complex64"),
        ({"fp": np.zeros((32, 9), np.complex64)}, "data.x"),
        ({"x": np.zeros(3)}, "data.x"),
        ({"freq": np.zeros(3)}, "data.freq"),
        ({"fp": np.full((32, 8), np.nan, np.complex64)}, "finite"),
    ],
)
def test_bad_gotcha_fields(tmp_path, change, says):
    scipy.io.savemat(tmp_path / "a.mat", {"data": gotcha_struct() | change})
    with pytest.raises(FormatError, match=says) as error:
        read(tmp_path / "a.mat")
    assert_one_line(error)


def test_rounded_reference_ranges_are_computed_anew(tmp_path):
    """r0 equal to the distance up to single precision: the distance counts; r0 that means something else counts as it is."""
    struct = gotcha_struct()
    distance = np.linalg.norm(np.concatenate([struct[name] for name in "xyz"]).astype(float), axis=0)
    for offset, expected in ((0.0, distance), (1.5, (distance + 1.5).astype(np.float32).astype(float))):
        rounded = (distance + offset).astype(np.float32)[None, :]
        scipy.io.savemat(tmp_path / "a.mat", {"data": struct | {"r0": rounded}})
        start = read(tmp_path / "a.mat").range_start
        # Ranges of 10 km in float64, sums of a few of them.
        np.testing.assert_allclose(start - start[0], expected - expected[0], rtol=0, atol=1e-10)


def test_gotcha_files_of_different_frequencies_are_not_joined(tmp_path):
    struct = gotcha_struct()
    scipy.io.savemat(tmp_path / "a.mat", {"data": struct})
    scipy.io.savemat(tmp_path / "b.mat", {"data": struct | {"freq": struct["freq"] + 1e8}})
    with pytest.raises(FormatError, match="frequencies differ"):
        read([tmp_path / "a.mat", tmp_path / "b.mat"])


def test_mat_without_the_struct(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"other": np.zeros(3)})
    with pytest.raises(FormatError, match="struct"):
        read(tmp_path / "a.mat")


def bwsi_fields(n_pulse=20, n_bin=64):
    generator = np.random.default_rng(5)
    times = np.linspace(0.0, 1.0, n_pulse)
    return {
        "scan_data": generator.integers(-1000, 1000, (n_pulse, n_bin)).astype(np.int32),
        "scan_time_s": times,
        "range_bins_m": 2.0 + 0.00915 * np.arange(n_bin),
        "mocap_time_s": np.linspace(0.0, 3.0, 301),
        "platform_pos_m": np.stack([np.full(301, -5.0), np.linspace(0.0, 3.0, 301), np.full(301, 1.8)], axis=1),
        "radar_to_mocap_time_offset_s_est": np.array(0.5),
        "range_bias_m_est": np.array(0.3),
    }


def test_motion_is_interpolated_with_the_time_offset(tmp_path):
    np.savez(tmp_path / "x.npz", **bwsi_fields())
    recorded = read(tmp_path / "x.npz")
    np.testing.assert_allclose(recorded.positions[:, 1], np.linspace(0.5, 1.5, 20), rtol=0, atol=1e-12)
    shifted = read_bwsi(tmp_path / "x.npz", time_offset=1.0, range_bias=0.0)
    np.testing.assert_allclose(shifted.positions[:, 1], np.linspace(1.0, 2.0, 20), rtol=0, atol=1e-12)
    assert (recorded.range_start, shifted.range_start) == (pytest.approx(1.7), pytest.approx(2.0))


def test_real_samples_become_profiles_with_the_carrier(tmp_path):
    """A pulse of 4.1 GHz, 0.6 GHz wide, whose range moves from pulse to pulse: the peak lies at its range, with the phase of its range."""
    fields = bwsi_fields(n_pulse=20, n_bin=512)
    bins, distance = fields["range_bins_m"], 3.5 + 0.011 * np.arange(20)[:, None]
    delay = 2.0 * (bins - distance) / 299792458.0
    pulse = np.exp(-0.5 * (delay * 0.6e9 * np.pi) ** 2) * np.cos(2.0 * np.pi * 4.1e9 * delay)
    np.savez(tmp_path / "x.npz", **(fields | {"scan_data": np.round(1e6 * pulse).astype(np.int32)}))
    found = read_bwsi(tmp_path / "x.npz", range_bias=0.0)
    assert found.wavelength == pytest.approx(299792458.0 / 4.1e9, rel=1e-12)
    index = np.argmax(np.abs(found.data), axis=1)
    ranges = found.range_start + found.range_spacing * index
    # The pulses overlap, so that the mean pulse, which is subtracted, is not small; it moves the peaks and turns their phases a little.
    assert np.abs(ranges - distance[:, 0]).max() <= 3 * found.range_spacing
    turned = found.data[np.arange(20), index] * np.exp(4j * np.pi * distance[:, 0] / found.wavelength)
    assert np.abs(np.angle(turned)).max() < 0.3
    assert np.abs(np.mean(turned)) == pytest.approx(1e6, rel=0.15)


def test_pulses_at_rest_are_left_out_of_the_path(tmp_path):
    """The platform stands still for the first half of the motion; a jitter of 0.3 mm doesn't count as motion, and the track is kept."""
    fields = bwsi_fields()
    times = fields["mocap_time_s"]
    jitter = 0.0003 * np.random.default_rng(6).standard_normal(times.size)
    fields["platform_pos_m"][:, 1] = np.maximum(0.0, times - 1.0) + np.where(times < 1.0, jitter, 0.0)
    np.savez(tmp_path / "x.npz", **fields)
    found = read(tmp_path / "x.npz")
    assert len(found.data) == len(found.positions) == 20
    write(tmp_path / "own.h5", found)
    for recorded in (found, read(tmp_path / "own.h5")):
        moving = along_path(recorded)
        assert moving.track is None
        assert moving.metadata["recorded_pulses"] == 20
        pulse_times = fields["scan_time_s"] + 0.5
        first = int(np.argmax(pulse_times > 1.0)) - 1  # half of its path lies behind the rest
        np.testing.assert_array_equal(moving.positions, found.positions[first:])
        gain = np.abs(moving.data).mean(axis=1) / np.abs(found.data[first:]).mean(axis=1)
        assert gain.mean() == pytest.approx(1.0, rel=1e-6)
        assert gain[0] < 0.75 * gain[2] == pytest.approx(0.75 * gain[-1], rel=1e-6)


def test_track_is_placed_anew(tmp_path):
    np.savez(tmp_path / "x.npz", **bwsi_fields())
    moved = with_time_offset(read(tmp_path / "x.npz"), 1.25)
    assert moved.track.offset == 1.25
    np.testing.assert_allclose(moved.positions[:, 1], np.linspace(1.25, 2.25, 20), rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match="within the track"):
        with_time_offset(moved, 2.5)
    with pytest.raises(ValueError, match="track"):
        with_time_offset(along_path(moved), 1.0)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"time": np.zeros(301)}, ValueError),
        ({"pulse_time": np.zeros(3)}, sarfocus.ShapeError),
        ({"position": np.zeros((4, 3))}, sarfocus.ShapeError),
        ({"position": np.full((301, 3), np.nan)}, sarfocus.NumericalError),
        ({"offset": np.inf}, ValueError),
        ({"minimum_step": -1.0}, ValueError),
    ],
)
def test_tracks_that_do_not_fit_are_refused(tmp_path, change, error):
    np.savez(tmp_path / "x.npz", **bwsi_fields())
    found = read(tmp_path / "x.npz")
    with pytest.raises(error, match="track"):
        dataclasses.replace(found, track=dataclasses.replace(found.track, **change))


def test_pulses_outside_the_motion_capture_are_refused(tmp_path):
    np.savez(tmp_path / "x.npz", **bwsi_fields())
    with pytest.raises(FormatError, match="time offset"):
        read_bwsi(tmp_path / "x.npz", time_offset=2.5)


def test_walk_has_no_positions(tmp_path):
    np.savez(tmp_path / "x.npz", **{k: v for k, v in bwsi_fields().items() if k in ("scan_data", "scan_time_s", "range_bins_m")})
    assert read(tmp_path / "x.npz").positions is None


def test_bwsi_shapes_that_disagree(tmp_path):
    np.savez(tmp_path / "x.npz", **(bwsi_fields() | {"scan_time_s": np.zeros(3)}))
    with pytest.raises(FormatError, match="scan_data") as error:
        read(tmp_path / "x.npz")
    assert_one_line(error)


def test_the_package_brings_its_readers_along(tmp_path):
    assert sarfocus.io.read is read
    assert sarfocus.io.write is write
