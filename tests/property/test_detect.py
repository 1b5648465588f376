"""sarfocus.detect against the definitions, on random images, windows and layouts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from reference import detect as oracle
from sarfocus import NumericalError, ShapeError, detect

METHODS = ["cell_averaging", "greatest_of", "ordered_statistic"]


def speckle(rows: int, columns: int, seed: int) -> NDArray[np.complex64]:
    rng = np.random.default_rng(seed)
    return (rng.normal(size=(rows, columns)) + 1j * rng.normal(size=(rows, columns))).astype(np.complex64)


def intensity(image: NDArray[np.complex64]) -> NDArray[np.float64]:
    return np.abs(image.astype(np.complex128)) ** 2


@settings(max_examples=25)
@given(
    st.sampled_from(METHODS),
    st.tuples(st.integers(1, 14), st.integers(1, 9)),
    st.tuples(st.tuples(st.integers(1, 4), st.integers(0, 3)), st.tuples(st.integers(0, 2), st.integers(0, 2))),
    st.integers(0, 2**32),
    st.booleans(),
)
def test_cfar_agrees_with_the_definition(
    method: str, shape: tuple[int, int], window: tuple[tuple[int, int], tuple[int, int]], seed: int, transposed: bool
) -> None:
    reference, guard = window
    image = speckle(*shape[::-1], seed).T if transposed else speckle(*shape, seed)
    excess = oracle.cfar(intensity(image), method, reference, guard, probability=0.2, rank=0.6)
    mask = detect.cfar_2d(image, method=method, false_alarm_probability=0.2, reference=reference, guard=guard, rank=0.6)  # type: ignore[arg-type]
    # The oracle's factors come from a quadrature and a root good to about 1e-8.
    clear = abs(excess - 1) > 1e-6
    np.testing.assert_array_equal(mask[clear], excess[clear] > 1)
    cells = list(np.ndindex(image.shape))
    tested = detect.cfar_2d_at(
        image,
        cells,
        method=method,  # type: ignore[arg-type]
        false_alarm_probability=0.2,
        reference=reference,
        guard=guard,
        rank=0.6,
    )
    np.testing.assert_allclose((tested["intensity"] / tested["threshold"]).reshape(image.shape), excess, rtol=1e-6)


@settings(max_examples=10)
@given(st.sampled_from(METHODS), st.integers(0, 2**32))
def test_cfar_1d_is_cfar_2d_of_one_gate(method: str, seed: int) -> None:
    image = speckle(60, 7, seed)
    options = {"method": method, "false_alarm_probability": 0.1}
    alone = detect.cfar_1d(image, **options, reference=6, guard=2)  # type: ignore[arg-type]
    np.testing.assert_array_equal(alone, detect.cfar_2d(image, **options, reference=(6, 0), guard=(2, 0)))  # type: ignore[arg-type]
    for gate in range(7):
        single = detect.cfar_1d(image[:, gate : gate + 1], **options, reference=6, guard=2)  # type: ignore[arg-type]
        np.testing.assert_array_equal(single[:, 0], alone[:, gate])


def test_mask_goes_where_it_is_wanted() -> None:
    image = speckle(80, 70, 1)
    expected = detect.cfar_2d(image, false_alarm_probability=0.05)
    target = np.zeros((70, 160), np.bool_)[:, ::2].T
    assert detect.cfar_2d(image, false_alarm_probability=0.05, out=target, threads=2) is target
    np.testing.assert_array_equal(target, expected)
    as_intensity = intensity(image).astype(np.float32)
    # Rounding the intensities to 24 bits moves no cell of this image across its threshold.
    np.testing.assert_array_equal(detect.cfar_2d(as_intensity, false_alarm_probability=0.05), expected)


@settings(max_examples=40)
@given(
    st.tuples(st.integers(1, 20), st.integers(1, 20)),
    st.tuples(st.integers(0, 3), st.integers(0, 3)),
    st.integers(0, 4),
    st.integers(0, 2**32),
)
def test_local_maxima_agree_with_the_definition(shape: tuple[int, int], half_width: tuple[int, int], levels: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.integers(0, levels + 1, shape).astype(np.complex64)  # ties everywhere
    found = detect.local_maxima(image, half_width=half_width)
    assert sorted(zip(found["azimuth"].tolist(), found["range"].tolist(), strict=True)) == oracle.local_maxima(intensity(image), half_width)
    assert (np.diff(found["intensity"]) <= 0).all()
    assert np.isnan(found["contrast"]).all()
    mask = rng.random(shape) < 0.5
    chosen = detect.local_maxima(image, half_width=half_width, mask=mask)
    np.testing.assert_array_equal(chosen[["azimuth", "range"]], found[mask[found["azimuth"], found["range"]]][["azimuth", "range"]])


@settings(max_examples=30)
@given(st.integers(0, 60), st.tuples(st.integers(0, 6), st.integers(0, 6)), st.integers(0, 2**32))
def test_coalesced_points_are_apart_and_represent_the_rest(n: int, half_width: tuple[int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.zeros(n, detect.point_dtype)
    points["azimuth"], points["range"] = rng.integers(-20, 20, (2, n))
    points["intensity"] = rng.integers(1, 5, n)
    kept = detect.coalesce(points, half_width)
    for k in range(kept.size):
        others = np.delete(kept, k)
        assert not (
            (abs(others["azimuth"] - kept["azimuth"][k]) <= half_width[0]) & (abs(others["range"] - kept["range"][k]) <= half_width[1])
        ).any()
    for point in points:
        near = (abs(kept["azimuth"] - point["azimuth"]) <= half_width[0]) & (abs(kept["range"] - point["range"]) <= half_width[1])
        assert (kept["intensity"][near] >= point["intensity"]).any()


@given(st.integers(1, 300), st.integers(0, 2**32))
def test_contrast_agrees_with_the_equation(n: int, seed: int) -> None:
    signal = speckle(1, 2 * n, seed)[0, ::-2]
    # Float64 sums of float32 amplitudes: 1 - x loses at most the digits in front of 1e-15.
    assert detect.contrast(signal) == pytest.approx(oracle.contrast(signal), abs=1e-12)


@given(st.integers(1, 100), st.integers(1, 40), st.integers(1, 12), st.integers(0, 2**32))
def test_spread_keeps_the_limit_and_fills_sections_evenly(n: int, limit: int, sections: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.zeros(n, detect.point_dtype)
    points["azimuth"], points["range"], points["intensity"] = rng.integers(0, 1000, n), np.arange(n), rng.random(n)
    chosen = detect.spread_evenly(points, 1000, limit=limit, sections=sections)
    assert chosen.size == min(n, limit)
    assert np.isin(chosen["range"], points["range"]).all()
    assert (np.diff(chosen["azimuth"]) >= 0).all()
    available = np.bincount(points["azimuth"] * sections // 1000, minlength=sections)
    used = np.bincount(chosen["azimuth"] * sections // 1000, minlength=sections)
    # A section is only two points behind another where it has no more.
    assert (used[used < used.max() - 1] == available[used < used.max() - 1]).all()


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_threads_do_not_matter(threads: int) -> None:
    image = speckle(300, 200, 5)
    for method in METHODS:
        np.testing.assert_array_equal(
            detect.cfar_2d(image, method=method, false_alarm_probability=0.05, threads=threads),  # type: ignore[arg-type]
            detect.cfar_2d(image, method=method, false_alarm_probability=0.05, threads=1),  # type: ignore[arg-type]
        )
    assert detect.local_maxima(image, threads=threads).tobytes() == detect.local_maxima(image, threads=1).tobytes()
    assert detect.strongest_samples(image, 5, threads=threads).tobytes() == detect.strongest_samples(image, 5, threads=1).tobytes()
    assert detect.strongest_gates(image, threads=threads).tobytes() == detect.strongest_gates(image, threads=1).tobytes()


def test_the_chain_of_the_stripmap_method_finds_the_points() -> None:
    image = speckle(600, 400, 6)
    rng = np.random.default_rng(7)
    azimuth, slant_range = rng.permutation(60)[:20] * 10 + 5, rng.permutation(40)[:20] * 10 + 5
    pattern = np.outer(np.sinc(np.arange(-9, 10) / 1.3), np.sinc(np.arange(-9, 10) / 1.3))
    for a, r in zip(azimuth, slant_range, strict=True):
        rows, columns = slice(max(0, a - 9), a + 10), slice(max(0, r - 9), r + 10)
        part = pattern[max(0, 9 - a) : 9 + 600 - a, max(0, 9 - r) : 9 + 400 - r]
        image[rows, columns] += (30 * part).astype(np.complex64)  # 26 dB above the clutter
    points = detect.coalesce(detect.local_maxima(image, mask=detect.cfar_2d(image, guard=(9, 9))))
    # 240 000 cells at 1e-6: 0.24 false alarms expected; clutter of 1.4 in amplitude moves no peak of 30.
    assert set(zip(azimuth.tolist(), slant_range.tolist(), strict=True)) <= set(
        zip(points["azimuth"].tolist(), points["range"].tolist(), strict=True)
    )
    assert points.size <= 22
    assert detect.spread_evenly(points, 600, limit=10).size == 10


def test_refusals_name_the_argument() -> None:
    image = speckle(8, 8, 3)
    with pytest.raises(ValueError, match="method: expected 'cell_averaging' or 'greatest_of' or 'ordered_statistic', got 'best'"):
        detect.cfar_2d(image, method="best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="false_alarm_probability"):
        detect.cfar_1d(image, false_alarm_probability=0.0)
    with pytest.raises(TypeError, match="image: expected a NumPy array of dtype"):
        detect.cfar_2d(intensity(image))  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="out"):
        detect.cfar_2d(image, out=np.zeros((8, 7), np.bool_))
    with pytest.raises(NumericalError, match=r"intensity: .* at \[0, 0\]"):
        detect.local_maxima(np.full((3, 3), -1, np.float32))
    with pytest.raises(ValueError, match=r"cells: expected a cell of the image \(8, 8\), got \(8, 0\)"):
        detect.cfar_1d_at(image, [(8, 0)])
    with pytest.raises(TypeError, match="points"):
        detect.coalesce(np.zeros(3))  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="mask"):
        detect.local_maxima(image, mask=np.zeros((8, 9), np.bool_))
