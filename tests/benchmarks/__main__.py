"""All benchmarks of speed by one command: ``python tests/benchmarks [--cpu] [--markdown] [GROUP …]``.

The groups are filter, cdf, sdf, obstacles, joints and start; all of them without a name. It prints a table with goals
and the ratio to the first recorded run of this machine, and keeps a record in ``.benchmarks`` beside the tests; with
``--markdown`` it ends with the tables of ``docs/performance.md``. The plants have scripts of their own,
``bench_mujoco.py`` and ``bench_franka.py``. None of this is collected by pytest.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import chain

import bench_cdf
import bench_filter
import bench_growth
import bench_sdf
import bench_start
import pages
from timing import Measurement, record, show

from cdfctl import load_robot

GROUPS: dict[str, Callable[[], Iterator[Measurement]]] = {
    "filter": lambda: bench_filter.measure(load_robot("franka")),
    "cdf": lambda: bench_cdf.measure(load_robot("franka")),
    "sdf": lambda: bench_sdf.measure(load_robot("franka")),
    "obstacles": bench_growth.by_obstacles,
    "joints": bench_growth.by_joints,
    "start": bench_start.measure,
}


def main() -> None:
    """Measure, print, record."""
    names = [argument for argument in sys.argv[1:] if argument not in ("--cpu", "--markdown")]
    unknown = [name for name in names if name not in GROUPS]
    if unknown:
        sys.exit(f"no benchmark '{unknown[0]}'; there are {', '.join(GROUPS)}, and --cpu and --markdown")
    done = show(chain.from_iterable(GROUPS[name]() for name in names or GROUPS))
    bench_growth.show_laws(done)
    if "--markdown" in sys.argv:
        print(pages.tables(done))
    print(f"recorded in {record(done)}")


if __name__ == "__main__":
    main()
