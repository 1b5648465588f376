"""Measured FFT plans: kept in a folder, used again, never needed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PROGRAM = """
import hashlib, numpy as np, sarfocus
generator = np.random.default_rng(1)
image = generator.standard_normal((2048, 6), dtype=np.float32).view(np.complex64)
geometry = sarfocus.StripmapGeometry(
    wavelength=0.031, prf=1000.0, velocity=100.0, slant_range=1000.0 + 0.5 * np.arange(3), doppler_bandwidth=800.0
)
first = sarfocus.azimuth_compress(image, geometry)
assert np.array_equal(first, sarfocus.azimuth_compress(image, geometry))
print(hashlib.sha256(first.tobytes()).hexdigest())
"""


def run(wisdom: Path | str) -> str:
    """Transform in a process of its own; return what names the bits of the result."""
    environment = os.environ | {"SARFOCUS_WISDOM": str(wisdom), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True, timeout=120)
    assert done.stderr == ""
    return done.stdout


def test_the_second_run_uses_what_the_first_one_measured(tmp_path: Path) -> None:
    first = run(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["single.wisdom"]
    measured = (tmp_path / "single.wisdom").read_bytes()
    assert run(tmp_path) == first
    assert (tmp_path / "single.wisdom").read_bytes() == measured


def test_a_damaged_file_is_measured_anew(tmp_path: Path) -> None:
    file = tmp_path / "single.wisdom"
    for damage in (b"", b"\0" * 100, b"(fftw-9.9 nothing", b"(" * 5000):
        file.write_bytes(damage)
        run(tmp_path)
        assert file.read_bytes().startswith(b"(fftw-")
        assert len(file.read_bytes()) > 100


def test_nothing_is_written_where_the_user_wants_none(tmp_path: Path) -> None:
    previous = Path.cwd()
    os.chdir(tmp_path)
    try:
        assert run("off") == run("off")
    finally:
        os.chdir(previous)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_made_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    assert run(tmp_path / "file") == run("off")
