"""A run while it goes on, for whoever wants to look: its steps, one after the other, in a folder beside the run folder.

The run folder itself is written whole, at the end. Until then ``.<name>.live`` next to it holds ``scenario.yaml`` and
``steps.bin``: a line of JSON that says what a record is, then one record of float64 a control step, appended in one
piece. The writer holds a lock on the file, so that a reader knows a run that died from one that goes on. Both files are
gone when the run folder is there.
"""

from __future__ import annotations

import fcntl
import json
import math
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np

from cdfctl.errors import InputError
from cdfctl.reading import check_regular, parse_json
from cdfctl.scenario.dump import dump
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.schema import Scenario
from cdfctl.simulation.recorder import STEP_ARRAYS
from cdfctl.simulation.rollout import Step
from cdfctl.simulation.run_folder import AGAIN, SCENARIO, trajectory_of
from cdfctl.types import Array, Trajectory

FORMAT, VERSION = "cdfctl-live", 1
STEPS = "steps.bin"
LONGEST, MOST = 65536, 10_000  # bytes of the first line, numbers along an axis of an array

_STATE = {"t": "t", "q": "q"}  # of a record, from the step's state
_SCENE = {"obstacle_pose": "poses", "obstacle_twist": "twists"}  # and from its scene
KNOWN = {*_STATE, *_SCENE, *STEP_ARRAYS, "step_time"}
NEEDED = {"t", "q", *_SCENE, "u", "h", "infeasible", "step_time"}


def live_folder(folder: Path) -> Path:
    """Where the run that will be written to ``folder`` is kept while it goes on."""
    whole = folder.absolute()
    return whole.parent / f".{whole.name}.live"


class Journal:
    """Writes the steps of one run as they come; gone when it is closed.

    A disk that fails must not end a run: then the journal stops, and ``problem`` says why.
    """

    def __init__(self, folder: Path, scenario: Scenario, *, on: bool) -> None:
        """For a run into ``folder``. Nothing is written before the first step, nor ever unless ``on``.

        Raises:
            InputError: another run into the same folder is going on.
        """
        self._live, self._scenario = live_folder(folder), scenario
        self._file: IO[bytes] | None = None
        self._shapes: dict[str, tuple[int, ...]] = {}
        self._on = on
        self.problem: str | None = None
        if on and is_going_on(self._live):
            raise InputError(f"{folder}: another run into it is going on", hint="give another --out")

    def through(self, steps: Iterator[Step]) -> Iterator[Step]:
        """The same steps, each written down on its way."""
        for step in steps:
            if self._on and self.problem is None:
                try:
                    self._write(step)
                except OSError as error:
                    self.problem = f"{self._live}: cannot be written: {error.strerror or error}"
            yield step

    def close(self) -> None:
        """Remove it."""
        if self._file is not None:
            self._file.close()
            shutil.rmtree(self._live, ignore_errors=True)
            self._file = None

    def _write(self, step: Step) -> None:
        given = _record(step)
        if self._file is None:
            self._shapes = {name: value.shape for name, value in given.items()}
            self._file = self._open()
        # An array that a controller gives at some steps only is NaN at the others, as in the run folder.
        parts = [np.ravel(given.get(name, np.full(shape, np.nan))) for name, shape in self._shapes.items()]
        self._file.write(np.concatenate(parts).astype("<f8").tobytes())

    def _open(self) -> IO[bytes]:
        self._live.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f"{self._live.name}.", dir=self._live.parent))
        try:
            (draft / SCENARIO).write_text(dump(self._scenario), encoding="utf-8")
            fields = [[name, list(shape)] for name, shape in self._shapes.items()]
            header = {"format": FORMAT, "version": VERSION, "fields": fields}
            file = (draft / STEPS).open("wb", buffering=0)
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            file.write(json.dumps(header).encode() + b"\n")
            shutil.rmtree(self._live, ignore_errors=True)  # of a run that died
            draft.rename(self._live)
        except OSError:
            shutil.rmtree(draft, ignore_errors=True)
            raise
        return file


@contextmanager
def journal(folder: Path, scenario: Scenario, *, on: bool) -> Iterator[Journal]:
    """A journal, removed at the end; arguments and errors as of :class:`Journal`."""
    kept = Journal(folder, scenario, on=on)
    try:
        yield kept
    finally:
        kept.close()


def _record(step: Step) -> dict[str, Array]:
    values = {name: getattr(step.state, source) for name, source in _STATE.items()}
    values |= {name: getattr(step.scene, source) for name, source in _SCENE.items()}
    given = {name: getattr(step.decision, name, None) for name in STEP_ARRAYS}
    values |= {name: value for name, value in given.items() if value is not None}
    values["step_time"] = math.nan  # the run folder's alone
    return {name: np.asarray(value, dtype=np.float64) for name, value in values.items()}


def is_going_on(live: Path) -> bool:
    """Whether a run writes to the folder ``live`` now."""
    try:
        check_regular(live / STEPS)
        with (live / STEPS).open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


class JournalReader:
    """Reads a journal as it grows.

    Attributes:
        scenario: of the run, as resolved.
    """

    def __init__(self, live: Path) -> None:
        """Raises :class:`cdfctl.errors.InputError` where ``live`` is no journal of this version."""
        self._live = live
        try:
            for name in (SCENARIO, STEPS):
                check_regular(live / name)
            self._file = (live / STEPS).open("rb")
        except OSError as error:
            raise _unreadable(live, error) from None
        try:
            self.scenario = load_scenario(live / SCENARIO).scenario
            self._fields = _fields(self._file.readline(LONGEST))
        except ValueError as error:
            self._file.close()
            raise InputError(f"{live / STEPS}: not a run in progress of this cdfctl: {error}", hint=AGAIN) from None
        except OSError as error:  # what opens like a file need not read like one: /proc/self/mem
            self._file.close()
            raise _unreadable(live, error) from None
        except InputError:
            self._file.close()
            raise
        self._width = sum(math.prod(shape) for _, shape in self._fields)
        self._rest = b""
        self._rows = np.zeros((0, self._width))

    @property
    def going_on(self) -> bool:
        """Whether the run may still add steps."""
        return is_going_on(self._live)

    def poll(self) -> Trajectory | None:
        """The steps that are complete by now as a trajectory; None where none has come since the last time.

        It ends in the state before the newest step. Raises :class:`cdfctl.errors.InputError` where the journal cannot
        be read any more.
        """
        try:
            self._rest += self._file.read()
        except OSError as error:
            raise _unreadable(self._live, error) from None
        whole = len(self._rest) // (8 * self._width) * (8 * self._width)
        if not whole:
            return None
        rows = np.frombuffer(self._rest[:whole], dtype="<f8").reshape(-1, self._width)
        self._rest = self._rest[whole:]
        self._rows = np.concatenate([self._rows, rows])
        return self._trajectory()

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    def _trajectory(self) -> Trajectory:
        N, start = len(self._rows) - 1, 0
        arrays: dict[str, Any] = {}
        for name, shape in self._fields:
            end = start + math.prod(shape)
            columns = self._rows[:, start:end].reshape(-1, *shape)
            arrays[name] = columns if name in _STATE or name in _SCENE else columns[:N]
            start = end
        arrays["infeasible"] = arrays["infeasible"] != 0.0
        return trajectory_of(arrays, self._live / STEPS)


def _unreadable(live: Path, error: OSError) -> InputError:
    return InputError(f"{live}: cannot be read: {error.strerror or error}", hint=AGAIN)


def _fields(line: bytes) -> list[tuple[str, tuple[int, ...]]]:
    """The names and shapes of a record, as the first line of a journal says. Raises :class:`ValueError`."""
    header = parse_json(line.decode("utf-8"))
    if not isinstance(header, dict) or header.get("format") != FORMAT or not isinstance(header.get("fields"), list):
        raise ValueError("its first line is not that of a journal")
    if header.get("version") != VERSION:
        raise ValueError(f"format {header.get('version')}, this one reads {VERSION}")
    fields = []
    for field in header["fields"]:
        if not (isinstance(field, list) and len(field) == 2 and isinstance(field[1], list) and len(field[1]) <= 2):
            raise ValueError("its first line is damaged")
        name, shape = field
        if not isinstance(name, str) or name not in KNOWN or not all(type(k) is int and 0 <= k <= MOST for k in shape):
            raise ValueError("its first line is damaged")
        fields.append((name, tuple(shape)))
    if len({name for name, _ in fields}) != len(fields) or not {name for name, _ in fields} >= NEEDED:
        raise ValueError("its first line is damaged")
    return fields
