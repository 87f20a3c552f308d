"""Files of cdfctl as a failing disk, another program, or an enemy leaves them.

``spoil`` takes the bytes of a good file and gives bad ones. ``KINDS`` are honest accidents, after which a file cannot
be read as it was meant; ``forged`` keeps the outside whole (JSON stays JSON, checksums fit) and lies inside.
"""

from __future__ import annotations

import io
import json
import random
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(range(256))
KINDS = ("empty", "truncated", "flipped", "noise", "zeros", "foreign", "longer")
VALUES: list[Any] = [
    None, True, -1, 0, 1, 2, 99, 10**400, -1e308, 1e-320, "", "x", "../../x", "\u202e", "<script>", [], {}, [[]],
    [None], {"x": 1}, [0] * 5000, float("nan"), float("inf"),
]  # fmt: skip


def spoil(kind: str, raw: bytes, rng: random.Random) -> bytes:
    """``raw`` after an accident of this kind."""
    match kind:
        case "empty":
            return b""
        case "truncated":
            return raw[: rng.randrange(len(raw))] if raw else raw
        case "flipped":
            data = bytearray(raw)
            for _ in range(rng.choice([1, 1, 1, 8]) if data else 0):
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
            return bytes(data)
        case "noise":
            at = rng.randrange(len(raw) + 1)
            return raw[:at] + rng.randbytes(rng.choice([1, 64, 4096])) + raw[at + 64 :]
        case "zeros":  # what a file system leaves of a write that power cut short
            at = rng.randrange(len(raw) + 1)
            return raw[:at] + bytes(len(raw) - at)
        case "foreign":
            return rng.choice([PNG, b"hello\n", b"[1, 2]\n", b"{}\n", b"\xff\xfe\0", b"PK\x05\x06" + bytes(18)])
        case _:
            return raw + rng.choice([raw, b"\n", b"{\n", rng.randbytes(100)])


def forge(name: str, raw: bytes, rng: random.Random) -> bytes:
    """``raw``, of the file called ``name``, as someone writes it who knows the format."""
    if name.endswith(".npz"):
        return forge_npz(raw, rng)
    if name.endswith((".safetensors", ".chunk")):
        return forge_table(raw, rng)
    if name.endswith(".bin"):  # a line of JSON, then numbers
        head, _, rest = raw.partition(b"\n")
        return forge(".json", head, rng) + b"\n" + rest
    if rng.random() < 0.1:
        return rng.choice([b"[" * 100_000, b'{"a":' * 100_000, b"9" * 100_000, b'"' + b"a" * 5_000_000 + b'"'])
    lines = raw.decode().split("\n") if name.endswith(".jsonl") else [raw.decode()]
    line = rng.randrange(len(lines))
    try:
        lines[line] = json.dumps(forge_document(json.loads(lines[line]), rng))
    except ValueError:  # YAML, or the empty end of the lines
        lines[line] = lines[line].replace(":", ": !!python/name:os.system", 1)
    return "\n".join(lines).encode()


def forge_document(document: Any, rng: random.Random) -> Any:
    """``document`` with a value lost, moved or changed in one place or two."""
    for _ in range(rng.choice([1, 1, 2])):
        found = _places(document)
        if not found:
            return rng.choice(VALUES)
        parent, key = rng.choice(found)
        match rng.randrange(4):
            case 0:
                del parent[key]
            case 1:
                other, its = rng.choice(found)
                parent[key] = json.loads(json.dumps(other[its])) if its in _keys(other) else None
            case _:
                parent[key] = rng.choice(VALUES)
    return document


def _keys(value: Any) -> Any:
    return value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()


def _places(value: Any) -> list[tuple[Any, Any]]:
    found = [(value, key) for key in _keys(value)]
    return found + [place for key in _keys(value) for place in _places(value[key])]


def forge_npz(raw: bytes, rng: random.Random) -> bytes:
    """Arrays of other shapes, types and values; pickles; arrays that unpack to gigabytes, or say that they do."""
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = rng.choice(list(members))
    array = np.load(io.BytesIO(members[name]), allow_pickle=False)
    method = zipfile.ZIP_STORED
    match rng.randrange(9):
        case 0:
            del members[name]
        case 1:
            members[name] = npy(np.array([Evil()], dtype=object), pickled=True)
        case 2:
            members[name] = npy(array.astype(rng.choice(["<f4", "<i8", "?", "<U9", "<c16", ">f8"])))
        case 3:
            members[name] = npy(rng.choice([array[:-1], array[None], array.ravel()[:0], np.float64(1.0)]))
        case 4 if array.dtype == np.float64 and array.size:
            array.flat[rng.randrange(array.size)] = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e-320])
            members[name] = npy(array)
        case 5:  # a header that asks for petabytes
            members[name] = members[name].replace(b"'shape': (", b"'shape': (%d, " % 10 ** rng.choice([9, 15, 30]), 1)
        case 6:  # two gigabytes of nothing in two megabytes of archive
            members[name] = npy(np.zeros(0))[:-1].replace(b"(0,)", b"(%d,)" % (BOMB // 8), 1) + b"\n"
            return _bomb(members, name)
        case 7:
            members["../../../../tmp/evil.npy"] = members[name]
        case _:
            method = zipfile.ZIP_DEFLATED
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive:
        for key, data in members.items():
            archive.writestr(key, data)
    return packed.getvalue()


BOMB = 2 * 2**30


def _bomb(members: dict[str, bytes], name: str) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for key, data in members.items():
            with archive.open(key, "w", force_zip64=True) as file:
                file.write(data)
                for _ in range(BOMB // 2**24 if key == name else 0):
                    file.write(bytes(2**24))
    return packed.getvalue()


def npy(array: Any, pickled: bool = False) -> bytes:
    """One array as the bytes of a ``.npy`` file."""
    file = io.BytesIO()
    np.save(file, np.asarray(array), allow_pickle=pickled)
    return file.getvalue()


class Evil:
    """Unpickled, it leaves a file behind."""

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (Path("pwned"),)


def forge_table(raw: bytes, rng: random.Random) -> bytes:
    """A table whose checksum fits, and whose arrays or metadata lie."""
    import tempfile

    from cdfctl.fields.table.file import read_file, write_file

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a"
        path.write_bytes(raw)
        mapped, metadata = read_file(path)
        arrays = {name: array.copy() for name, array in mapped.items()}
        name = rng.choice(list(arrays))
        array = arrays[name]
        match rng.randrange(6):
            case 0:
                del arrays[name]
            case 1:
                arrays[name] = array[:-1] if rng.random() < 0.5 else array.reshape(-1, 1)
            case 2:
                other = np.float32 if array.dtype != np.float32 else np.float64
                arrays[name] = array.astype(other)
            case 3 if "first" in arrays:  # a number of points that is not, or only after it has run over
                side = rng.choice([2**32, 2**62, 2**63 - 1])
                arrays["shape"] = np.array([side, side, rng.choice([1, 4])])
                if rng.random() < 0.7:
                    arrays |= {"first": np.zeros(1, np.int64), "piece": arrays["piece"][:0], "q": arrays["q"][:0]}
            case 4 if metadata:
                metadata[rng.choice(list(metadata))] = rng.choice(["", "2", "{}", "x", "[" * 100_000, '{"a": 1}'])
            case _ if array.size:
                whole = array.dtype.kind == "i"
                wrong = rng.choice([-1, 2**15 - 1]) if whole else rng.choice([np.nan, np.inf, 1e-38, 1e38, -1.0])
                array.flat[rng.randrange(array.size)] = wrong
        write_file(path, arrays, metadata)
        return path.read_bytes()
