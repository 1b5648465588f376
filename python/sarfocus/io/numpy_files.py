"""``.npy`` (a bare image) and ``.npz`` (an object with its metadata)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import FormatError
from .layout import to_fields
from .model import Image, PhaseHistory


def read_npy(path: Path) -> Image:
    """Read a bare complex64 image [n_azimuth, n_range]."""
    return Image(np.load(path, allow_pickle=False), metadata={"source": path.name})


def write_npy(path: Path, image: Image) -> None:
    """Write the samples only: an .npy file has no room for the rest."""
    with path.open("wb") as stream:
        np.save(stream, image.data, allow_pickle=False)


def load_npz(path: Path) -> dict[str, npt.NDArray[Any]]:
    """Every array of the archive; objects that need unpickling are refused."""
    with path.open("rb") as stream:
        archive = np.load(stream, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise FormatError("expected an .npz archive, got another kind of file")
        with archive:
            return {name: archive[name] for name in archive.files}


def write_npz(path: Path, item: PhaseHistory | Image, *, compress: bool) -> None:
    """Write every field of the layout as one array."""
    save: Callable[..., None] = np.savez_compressed if compress else np.savez
    with path.open("wb") as stream:
        save(stream, **to_fields(item))
