"""Seven points under a piecewise linear phase error: iteration-free against iterated stripmap autofocus [Xie2023, table 3].

Each of the seven pieces of the error displaces the point in its middle. One line over the whole strip cannot be known from the data; it
displaces a point in proportion to its slant range, so that `relative_shift` is what is left of the shifts after such a line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import StripmapGeometry, azimuth_compress, quality, simulate, spga, spga_linear, strip
from .crlb import without_line
from .model import Reproduction, Requirement, at_most
from .strips import ComplexArray, FloatArray, airborne, aligned, described, piecewise_linear, slope_of_shift

N = 4096  # pixels, azimuth and range
MARGIN = 0.55  # longest apertures from the ends of the strip to the first and the last point: theirs lie within it
RANGE_START, RANGE_SPACING = 8000.0, 0.5  # m
GATES = (0.06, 0.78, 0.27, 0.55, 0.39, 0.12, 0.70)  # of the range axis
SHIFTS = (0.0, 8.0, 0.0, -4.0, 4.0, 8.0, 0.0)  # pixels [Xie2023, table 3, row A]
SEED = 5535
UPSAMPLE, LOBES, SEARCH = 32, 10, 24  # points a pixel; side lobes each side; pixels round the true place
SHIFT_BOUND, SIDELOBE_BOUND = 0.02, 0.05  # pixels, dB
PAPER_SHIFT, PAPER_PSLR, PAPER_ISLR = 0.16, -12.34, -9.87  # of the paper's own method: pixels, dB, dB
DRAWS = 3
WIDTH = 64  # pixels, of the matrix R that is drawn
Progress = Callable[[str, int, int], None] | None
Estimator = Callable[..., Any]

PAPER: dict[str, dict[str, tuple[float, ...]]] = {
    "A error only": {
        "shift": (0, 8, 0, -4, 4, 8, 0, 2.29),
        "pslr_db": (-1.75, -13.26, -5.25, -4.00, -4.73, -3.62, -2.34, -4.99),
        "islr_db": (-0.18, -10.48, -0.37, -2.40, 0.23, -2.41, -0.61, -2.32),
    },
    "B spga, 1 pass": {
        "shift": (1.15, 7.25, 0.59, -4.65, 1.44, 5.25, 1.96, 1.86),
        "pslr_db": (-0.46, -2.18, -5.98, -3.51, -0.93, -0.74, -0.40, -2.03),
        "islr_db": (-0.71, 4.75, -3.57, 7.82, -7.42, -4.13, -2.84, -0.87),
    },
    "C spga, 6 passes": {
        "shift": (6.37, 13.21, 6.00, 6.00, 10.28, 10.03, 7.04, 8.42),
        "pslr_db": (-3.13, -13.10, -2.09, -0.60, -8.15, -11.34, -11.34, -7.11),
        "islr_db": (-0.72, 0.07, -10.09, 7.72, -6.92, -8.46, -9.56, -3.99),
    },
    "D search": {
        "shift": (-0.02, -0.19, -0.16, 0.03, -0.28, -0.16, -0.34, -0.16),
        "pslr_db": (-13.10, -13.24, -11.86, -11.68, -12.76, -12.74, -11.06, -12.34),
        "islr_db": (-10.30, -10.07, -9.82, -9.73, -9.98, -9.97, -9.22, -9.87),
    },
}  # P1 to P7 and their average
METHODS: dict[str, tuple[Estimator, dict[str, Any]]] = {
    "B spga, 1 pass": (spga, {"iterations": 1}),
    "C spga, 6 passes": (spga, {"iterations": 6}),
    "D search": (spga_linear, {"matching": "search", "refine": False}),
    "D slope": (spga_linear, {"matching": "slope"}),
    "D search, refined": (spga_linear, {"matching": "search"}),
    "D slope, not refined": (spga_linear, {"matching": "slope", "refine": False}),
}
RANDOM_METHODS = ("C spga, 6 passes", "D search", "D slope")


@dataclass
class Scene:
    """Points on a strip, their phase error, and the image without and with it."""

    geometry: StripmapGeometry
    points: list[tuple[float, int]]  # azimuth in pixels, range gate
    shifts: tuple[float, ...]  # pixels, of every point by the error
    phase_error: FloatArray
    truth: ComplexArray
    image: ComplexArray


@dataclass
class Measured:
    """What a point's response measures, or what several do on average."""

    shift: float  # pixels of azimuth from the true place
    pslr_db: float
    islr_db: float
    relative_shift: float = 0.0


def run(*, seed: int = SEED, n: int = N, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Run the table on an image of n x n pixels; the seed draws the phases of the points."""
    scene = make_scene(table_geometry(n), SHIFTS, np.random.default_rng(seed), threads=threads)
    rows, found, pictures = measure_methods(scene, tuple(METHODS), "", threads, progress)
    parameters = {"n": n, "shifts": list(SHIFTS), "seed": seed} | described(scene.geometry) | measuring()
    pictures["R"] = matrix(scene, threads)
    return Reproduction(name="xie2023-table3", parameters=parameters, rows=rows, required=required(found), pictures=pictures)


def run_random(*, seed: int = SEED, n: int = N, threads: int = 0, progress: Progress = None) -> Reproduction:
    """Run three more sets of slopes, positions and radar parameters, drawn at random."""
    rows: list[dict[str, Any]] = []
    bounds: list[Requirement] = []
    drawn = []
    for draw in range(DRAWS):
        generator = np.random.default_rng([seed, draw])
        geometry = random_geometry(generator, n)
        shifts = tuple(float(shift) for shift in np.round(generator.uniform(min(SHIFTS), max(SHIFTS), len(SHIFTS)), 2))
        scene = make_scene(geometry, shifts, generator, spread=0.2, threads=threads)
        name = f"draw {draw + 1}, "
        found_rows, found, _ = measure_methods(scene, RANDOM_METHODS, name, threads, progress)
        rows += found_rows
        bounds += [item.model_copy(update={"what": f"{name}{item.what}"}) for item in required(found)]
        places = [{"azimuth": round(u, 2), "range": g} for u, g in scene.points]
        drawn.append({"shifts": list(shifts), "points": places} | described(geometry))
    parameters = {"n": n, "seed": seed, "draws": drawn} | measuring()
    return Reproduction(name="xie2023-random", parameters=parameters, rows=rows, required=bounds)


def table_geometry(n: int) -> StripmapGeometry:
    """Return the collection of the table; on a smaller image the apertures shrink with it."""
    return airborne(n, RANGE_START * n / N, RANGE_SPACING * n / N)


def random_geometry(generator: np.random.Generator, n: int) -> StripmapGeometry:
    """Draw a collection whose neighbouring apertures overlap: 0.18 to 0.25 of the strip at the nearest gate."""
    velocity, bandwidth = generator.uniform(90.0, 160.0), generator.uniform(220.0, 380.0)
    wavelength, oversampling = generator.uniform(0.028, 0.034), generator.uniform(1.15, 1.5)
    aperture = generator.uniform(0.18, 0.25) * n
    start = 2.0 * velocity**2 * aperture / (wavelength * bandwidth**2 * oversampling)
    fields = {"wavelength": wavelength, "velocity": velocity, "doppler_bandwidth": bandwidth, "prf": oversampling * bandwidth}
    return airborne(n, start, 0.15 * start / n, **fields)


def make_scene(
    geometry: StripmapGeometry, shifts: tuple[float, ...], generator: np.random.Generator, *, spread: float = 0.0, threads: int = 0
) -> Scene:
    """Simulate the points; with `spread` the inner ones leave their even places by up to that share of a step, and gates are drawn."""
    n = len(geometry.slant_range)
    margin = MARGIN * geometry.aperture_samples(n - 1)
    azimuth = np.linspace(margin, n - 1 - margin, len(shifts))
    azimuth[1:-1] += spread * (azimuth[1] - azimuth[0]) * generator.uniform(-1.0, 1.0, len(shifts) - 2)
    gates = generator.uniform(0.02, 0.98, len(shifts)) if spread else np.asarray(GATES)
    points = [(float(u), int(g)) for u, g in zip(azimuth, gates * n, strict=True)]
    slopes = [slope_of_shift(geometry, shift, gate) for shift, (_, gate) in zip(shifts, points, strict=True)]
    phase_error = piecewise_linear(n, 0.5 * (azimuth[1:] + azimuth[:-1]), slopes)
    reflectivity = np.exp(2j * np.pi * generator.random(len(points)))
    image = simulate.stripmap(geometry, points, reflectivity, n_azimuth=n, threads=threads)
    truth = azimuth_compress(image, geometry, threads=threads)
    image *= np.exp(1j * phase_error)[:, None].astype(np.complex64)
    return Scene(geometry, points, shifts, phase_error, truth, azimuth_compress(image, geometry, threads=threads))


def measure_methods(
    scene: Scene, methods: tuple[str, ...], prefix: str, threads: int, progress: Progress
) -> tuple[list[dict[str, Any]], dict[str, list[Measured]], dict[str, Any]]:
    """Measure the points of the error-free image, of the image with the error, and of what every method makes of it."""
    found: dict[str, list[Measured]] = {}
    pictures: dict[str, Any] = {"truth": scene.phase_error, "points": scene.points, "cuts": {}, "phases": {}}

    def keep(method: str, image: ComplexArray) -> None:
        responses = [respond(scene, image, point) for point in scene.points]
        found[method] = relative(scene, [to_measured(one, point) for one, point in zip(responses, scene.points, strict=True)])
        pictures["cuts"][method] = [cut_of(one, point) for one, point in zip(responses, scene.points, strict=True)]
        if progress is not None:
            progress(f"{prefix}points".capitalize(), len(found), len(methods) + 2)

    keep("error-free", scene.truth)
    keep("A error only", scene.image)
    for method in methods:
        estimator, options = METHODS[method]
        result = estimator(scene.image, scene.geometry, **options, do_no_harm=False, threads=threads)
        keep(method, result.image)
        pictures["phases"][method] = np.asarray(result.phase_error)
        if method == "D slope":
            pictures |= {"seams": result.diagnostics["strip"]["seams"]} | seam_places(scene.geometry, np.asarray(result.points))
    return [row for method, points in found.items() for row in table_rows(prefix + method, points)], found, pictures


def seam_places(geometry: StripmapGeometry, points: npt.NDArray[np.void]) -> dict[str, FloatArray]:
    """Return of every point its azimuth, half its aperture (samples) and its displacement by a slope of 1 rad a sample (pixels)."""
    gates = [round(float(gate)) for gate in points["range"]]
    return {
        "azimuth": np.asarray(points["azimuth"] - points["shift"], dtype=np.float64),
        "reach": np.array([0.5 * geometry.aperture_samples(gate) for gate in gates]),
        "pixels": np.array([1.0 / slope_of_shift(geometry, 1.0, gate) for gate in gates]),
    }


def respond(scene: Scene, image: ComplexArray, point: tuple[float, int]) -> quality.PointResponse:
    """Measure the response nearest to the true place of a point, 32 times interpolated."""
    sampling = (scene.geometry.prf / scene.geometry.doppler_bandwidth, 1.0)
    return quality.point_response(image, point, upsample=UPSAMPLE, search=SEARCH, lobes=LOBES, oversampling=sampling)


def to_measured(found: quality.PointResponse, point: tuple[float, int]) -> Measured:
    """Return the figures along azimuth."""
    return Measured(found.azimuth.position - point[0], found.azimuth.pslr_db, found.azimuth.islr_db)


def cut_of(found: quality.PointResponse, point: tuple[float, int]) -> tuple[FloatArray, FloatArray]:
    """Return the cut along azimuth: pixels from the true place, amplitude (1: the error-free peak)."""
    near = np.abs(found.azimuth.cut_position - point[0]) <= SEARCH
    return (found.azimuth.cut_position - point[0])[near], (found.amplitude * found.azimuth.cut)[near]


def relative(scene: Scene, measured: list[Measured]) -> list[Measured]:
    """Fill in the shifts that are left after one line over the strip, which shifts in proportion to slant range."""
    slant_range = np.asarray(scene.geometry.slant_range)[[gate for _, gate in scene.points]]
    shifts = np.array([one.shift for one in measured])
    left = shifts - slant_range * float(slant_range @ shifts) / float(slant_range @ slant_range)
    for one, shift in zip(measured, left, strict=True):
        one.relative_shift = float(shift)
    return measured


def average(points: list[Measured]) -> Measured:
    """Return the plain mean of every figure, as the paper does."""
    names = ("shift", "pslr_db", "islr_db", "relative_shift")
    return Measured(**{name: float(np.mean([getattr(one, name) for one in points])) for name in names})


def table_rows(method: str, points: list[Measured]) -> list[dict[str, Any]]:
    """Return a row for each point and one for their average, the paper's figures beside ours."""
    paper = PAPER.get(method)
    rows = []
    for index, one in enumerate([*points, average(points)]):
        case = f"P{index + 1}" if index < len(points) else "average"
        row = {"method": method, "case": case, "shift": one.shift, "relative_shift": one.relative_shift}
        row |= {"pslr_db": one.pslr_db, "islr_db": one.islr_db}
        rows.append(row | {f"paper_{name}": None if paper is None else paper[name][index] for name in ("shift", "pslr_db", "islr_db")})
    return rows


def required(found: dict[str, list[Measured]]) -> list[Requirement]:
    """Return the bounds: of the method as it is by default, point by point; of the paper's own traversal, what the paper reached."""
    free, slope, search = found["error-free"], found["D slope"], found["D search"]
    pairs = list(zip(slope, free, strict=True))
    mean = average(search)
    return [
        at_most("D slope: largest relative shift, pixels", max(abs(one.relative_shift) for one in slope), SHIFT_BOUND),
        at_most(
            "D slope: largest difference in PSLR from error-free, dB", max(abs(a.pslr_db - b.pslr_db) for a, b in pairs), SIDELOBE_BOUND
        ),
        at_most(
            "D slope: largest difference in ISLR from error-free, dB", max(abs(a.islr_db - b.islr_db) for a, b in pairs), SIDELOBE_BOUND
        ),
        at_most(
            "D search: mean size of the relative shift, pixels", float(np.mean([abs(one.relative_shift) for one in search])), PAPER_SHIFT
        ),
        at_most("D search: mean PSLR, dB", mean.pslr_db, PAPER_PSLR),
        at_most(f"D search: mean ISLR over {LOBES} side lobes, dB", mean.islr_db, PAPER_ISLR),
    ]


def measuring() -> dict[str, Any]:
    """Return how the points are measured."""
    return {
        "upsample": UPSAMPLE,
        "lobes": LOBES,
        "islr_extent": f"{LOBES} side lobes each side: -10.11 dB without error (over 40 of them: -9.79 dB; the paper doesn't say how many)",
        "relative_shift": "shift less the best multiple of slant range: what one line over the strip, which the data don't tell, makes",
    }


def matrix(scene: Scene, threads: int) -> FloatArray:
    """Return the matrix R of the first two points [Xie2023, eq. 16, fig. 7]."""
    points = strip.select_points(scene.image, scene.geometry, threads=threads)
    apertures = strip.extract(scene.image, scene.geometry, points, threads=threads)
    return np.asarray(strip.search_matrix(apertures, 0, 1, width=WIDTH))


def draw(result: Reproduction, folder: Path) -> list[Path]:
    """Draw phases, seams, points and the matrix R; return the files written."""
    from ..report import strip_figures as figures  # noqa: PLC0415  matplotlib only where a picture is wanted
    from ..report.figures import save  # noqa: PLC0415

    held = result.pictures
    everywhere = np.ones(len(held["truth"]), dtype=np.bool_)
    truth = without_line(held["truth"])
    shown = {name: aligned(held["phases"][name], truth, everywhere) for name in RANDOM_METHODS}
    names = ("error-free", "A error only", "C spga, 6 passes", "D slope")
    cuts = [(f"P{n + 1}", {name: held["cuts"][name][n] for name in names}) for n in range(len(held["points"]))]
    made = {
        "phase": figures.phases_figure(truth, shown, [azimuth for azimuth, _ in held["points"]]),
        "seams": figures.seams_figure(held["seams"], held["azimuth"], held["reach"], held["pixels"]),
        "points": figures.points_figure(cuts),
        "matrix": figures.matrix_figure(held["R"]),
    }
    paths = [folder / f"xie2023_{name}.png" for name in made]
    for picture, path in zip(made.values(), paths, strict=True):
        save(picture, path)
    return paths
