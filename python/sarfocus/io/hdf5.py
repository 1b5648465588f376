"""HDF5 in the package's own layout (see `sarfocus.io.layout`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from .layout import from_fields, to_fields
from .model import Image, PhaseHistory

CHUNK_BYTES = 1 << 20


def read_hdf5(path: Path) -> PhaseHistory | Image:
    """Read what `write_hdf5` wrote."""
    fields: dict[str, Any] = {}

    def visit(name: str, node: h5py.Dataset | h5py.Group) -> None:
        if isinstance(node, h5py.Dataset):
            fields[name] = np.array(node.asstr()[()]) if h5py.check_string_dtype(node.dtype) else np.asarray(node[()])

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return from_fields(fields)


def write_hdf5(path: Path, item: PhaseHistory | Image, *, compress: bool) -> None:
    """Write every field as one dataset; two-dimensional ones in chunks of whole rows."""
    with h5py.File(path, "w") as file:
        for name, values in to_fields(item).items():
            if values.dtype.kind == "U":
                file.create_dataset(name, data=str(values[()]), dtype=h5py.string_dtype())
            else:
                file.create_dataset(name, data=values, **_storage(values, compress=compress))


def _storage(values: npt.NDArray[Any], *, compress: bool) -> dict[str, Any]:
    if values.ndim < 2 or values.nbytes < CHUNK_BYTES:
        return {}
    rows = max(1, CHUNK_BYTES // max(1, values[0].nbytes))
    storage: dict[str, Any] = {"chunks": (min(rows, values.shape[0]), *values.shape[1:]), "fletcher32": True}
    return storage | ({"compression": "gzip", "shuffle": True} if compress else {})
