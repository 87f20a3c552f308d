"""Make the pictures that the pages and the README show: ``python docs/_ext/pictures.py``.

They are committed, so that they are seen where no documentation is built. A palette of 256 colours keeps each below
150 kB.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from cdfctl.cli.main import main

PICTURES = Path(__file__).resolve().parents[1] / "pictures"
MOST_BYTES = 150_000


def make(folder: Path) -> None:
    """Run what is shown in ``folder``, and draw it."""
    run, bench = folder / "run", folder / "bench"
    commands = [
        ["run", "reach", "--out", str(run), "--quiet"],
        ["bench", "--suite", "paper", "--trials", "8", "--out", str(bench), "--quiet"],
        ["plot", str(run), "--figure", "joint-space", *_into("joint-space")],
        ["plot", str(bench), "--figure", "success", *_into("success")],
        ["plot", "--figure", "avoidance", *_into("avoidance")],
        ["plot", "--figure", "reaching", *_into("reaching")],
    ]
    for command in commands:
        status = main(command)
        if status:
            sys.exit(f"cdfctl {' '.join(command)}: exit status {status}")


def _into(name: str) -> list[str]:
    return ["--dpi", "110", "--out", str(PICTURES / f"{name}.png")]


def shrink(path: Path) -> None:
    """Reduce the colours of a picture to a palette."""
    from PIL import Image

    with Image.open(path) as picture:
        few = picture.convert("RGB").quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    if path.stat().st_size > MOST_BYTES:
        sys.exit(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        make(Path(place))
    for found in sorted(PICTURES.glob("*.png")):
        shrink(found)
