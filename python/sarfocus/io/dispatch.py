"""Which reader, which writer."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from .atomic import replacing
from .bwsi import bwsi_history, is_bwsi
from .errors import FormatError, reading
from .gotcha import read_gotcha
from .hdf5 import read_hdf5, write_hdf5
from .layout import from_fields
from .model import Image, PhaseHistory
from .numpy_files import load_npz, read_npy, write_npy, write_npz
from .tiff import read_tiff

HDF5_SUFFIXES = (".h5", ".hdf5")
TIFF_SUFFIXES = (".tif", ".tiff")
READABLE = ".mat, .npz, .npy, .h5, .hdf5, .tif, .tiff"
WRITABLE = ".npy, .npz, .h5, .hdf5"
PathText = str | PathLike[str]


def read(path: PathText | Sequence[PathText]) -> PhaseHistory | Image:
    """Read a phase history or an image.

    Parameters
    ----------
    path : path, or several
        Several Gotcha files are joined, in the order given, as one aperture.

    Raises
    ------
    FormatError
        In one line: which file, and what is wrong with it.
    """
    paths = [Path(path)] if isinstance(path, str | PathLike) else [Path(p) for p in path]
    if not paths:
        raise FormatError("expected at least one file, got none")
    if all(p.suffix.lower() == ".mat" for p in paths):
        return read_gotcha(paths)
    if len(paths) > 1:
        raise FormatError(f"{paths[1]}: only Gotcha .mat files can be joined")
    return _read_one(paths[0])


def _read_one(path: Path) -> PhaseHistory | Image:
    with reading(path):
        if path.is_dir():
            raise FormatError("is a directory")
        if not path.exists():
            raise FormatError("no such file")
        suffix = path.suffix.lower()
        if suffix == ".npy":
            return read_npy(path)
        if suffix == ".npz":
            fields = load_npz(path)
            return bwsi_history(fields, path.name) if is_bwsi(fields) else from_fields(fields)
        if suffix in HDF5_SUFFIXES:
            return read_hdf5(path)
        if suffix in TIFF_SUFFIXES:
            return read_tiff(path)
        raise FormatError(f"unknown kind of file «{suffix}», expected one of {READABLE}")


def writable(path: PathText) -> Path:
    """Return the path if `write` can write such a file there, before anything is computed for it."""
    target = Path(path)
    if target.suffix.lower() not in (".npy", ".npz", *HDF5_SUFFIXES):
        raise FormatError(f"{target}: unknown kind of file «{target.suffix}», expected one of {WRITABLE}")
    if not target.parent.is_dir():
        raise FormatError(f"{target}: no such directory: {target.parent}")
    if target.is_dir():
        raise FormatError(f"{target}: is a directory")
    return target


def write(path: PathText, item: PhaseHistory | Image, *, compress: bool = False) -> None:
    """Write a phase history or an image; an existing file is replaced only when the new one is complete.

    Parameters
    ----------
    path : path
        ``.npz``, ``.h5`` or ``.hdf5`` keep everything; ``.npy`` keeps the samples of an image only.
    item : PhaseHistory or Image
    compress : bool
        Compress (lossless); slower, and complex samples hardly shrink.
    """
    target = writable(path)
    suffix = target.suffix.lower()
    if suffix == ".npy" and not isinstance(item, Image):
        raise FormatError(f"{target}: an .npy file can't hold a phase history; use .npz or .h5")
    with replacing(target) as temporary:
        if suffix == ".npy" and isinstance(item, Image):
            write_npy(temporary, item)
        elif suffix == ".npz":
            write_npz(temporary, item, compress=compress)
        else:
            write_hdf5(temporary, item, compress=compress)
