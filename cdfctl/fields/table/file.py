"""One safetensors file, written whole or not at all, equal byte for byte for equal content, and checked when read.

The metadata hold strings only, as the format demands. One of them, ``checksum``, is the SHA-256 of everything else:
the other metadata, and name, type, shape and bytes of every array. The safetensors library writes metadata in no
fixed order, so the header is put together here; the library reads it and checks it.
"""

from __future__ import annotations

import hashlib
import json
import os
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdfctl.errors import InputError, MissingError
from cdfctl.reading import check_regular, drafted

Arrays = Mapping[str, NDArray[Any]]
TYPES = {"int64": "I64", "int16": "I16", "float32": "F32", "float64": "F64"}
KINDS = {code: np.dtype(name).newbyteorder("<") for name, code in TYPES.items()}


def write_file(path: Path, arrays: Arrays, metadata: Mapping[str, str]) -> None:
    """Write ``arrays`` and ``metadata`` to ``path``, through a file beside it that is then renamed.

    Raises:
        InputError: it cannot be written.
    """
    # Widest items first: then every array begins at a multiple of its item size, as compiled code expects.
    order = sorted(arrays, key=lambda name: (-arrays[name].dtype.itemsize, name))
    strings = {**metadata, "checksum": _checksum(arrays, metadata)}
    header: dict[str, Any] = {"__metadata__": dict(sorted(strings.items()))}
    place = 0
    for name in order:
        array = arrays[name]
        header[name] = {
            "dtype": TYPES[array.dtype.name],
            "shape": list(array.shape),
            "data_offsets": [place, place + array.nbytes],
        }
        place += array.nbytes
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with drafted(path, beside), beside.open("xb") as file:
            file.write(struct.pack("<Q", len(text)) + text)
            for name in order:
                file.write(_bytes(arrays[name]))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}", "give another --out, or make room") from None


def read_file(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """The arrays of ``path``, mapped into memory (a write to one stays private), and its metadata.

    Raises:
        MissingError: there is no such file.
        InputError: it cannot be read, is no safetensors file of ours, or was damaged since it was written.
    """
    metadata = read_metadata(path)
    try:
        with path.open("rb") as file:
            size = struct.unpack("<Q", file.read(8))[0]
            header = json.loads(file.read(size))
        raw = np.memmap(path, dtype=np.uint8, mode="c", offset=0)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    arrays: dict[str, NDArray[Any]] = {}
    for name, entry in header.items():
        if name == "__metadata__":
            continue
        kind = KINDS.get(entry["dtype"])
        if kind is None:
            raise InputError(f"{path}: not a file of cdfctl: '{name}' is of type {entry['dtype']}")
        start, end = (8 + size + place for place in entry["data_offsets"])
        arrays[name] = raw[start:end].view(kind).reshape(entry["shape"]).view(np.ndarray)
    if metadata.pop("checksum", None) != _checksum(arrays, metadata):
        raise InputError(f"{path}: damaged: its content is not what its checksum says")
    return arrays, metadata


def read_metadata(path: Path) -> dict[str, str]:
    """The metadata of ``path`` alone, which are not checked; ``checksum`` is among them.

    Raises:
        MissingError, InputError: as :func:`read_file`.
    """
    from safetensors import SafetensorError, safe_open

    if not path.exists():
        raise MissingError(f"{path}: no such file")
    try:
        check_regular(path)
        with safe_open(path, framework="np") as file:
            return dict(file.metadata() or {})
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: not a safetensors file, or a damaged one ({error})") from None


def _checksum(arrays: Arrays, metadata: Mapping[str, str]) -> str:
    digest = hashlib.sha256(json.dumps(dict(sorted(metadata.items()))).encode())
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"{name} {TYPES[array.dtype.name]} {list(array.shape)}".encode())
        digest.update(_bytes(array))
    return digest.hexdigest()


def _bytes(array: NDArray[Any]) -> bytes:
    little = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
    return little.tobytes()
