"""The bookkeeping of the benchmarks; what they measure is no matter of a test."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest


@pytest.fixture
def timing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location("benchmark_timing", Path(__file__).with_name("timing.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "RECORDS", tmp_path / "records")
    return module


def test_ratios_are_to_the_oldest_record_that_has_the_measurement(
    timing: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for when, names in (("2026-01-01", {"a": 2.0}), ("2026-01-02", {"a": 8.0, "b": 5.0})):
        monkeypatch.setattr(timing.time, "strftime", lambda *_, when=when: when)
        timing.record(timing.Measurement(name, np.full(3, ms)) for name, ms in names.items())
    measured = [timing.Measurement("a", np.ones(3), 0.5, 1.0), timing.Measurement("b", np.ones(3)), *_new(timing)]
    assert timing.show(measured) == measured
    a, b, new = capsys.readouterr().out.splitlines()[2:]
    assert a.split() == ["a", "1.000", "1.000", "3", "0.5!,", "1", "0.50"]
    assert b.split() == ["b", "1.000", "1.000", "3", "0.20"]
    assert new.split() == ["new", "4.000", "4.000", "1", "-"]


def _new(timing: ModuleType) -> list[object]:
    return [timing.Measurement("new", np.array([4.0]))]


def test_another_machine_is_no_reference(timing: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    timing.record([timing.Measurement("a", np.ones(3))])
    assert timing._first_recorded() == {"a": 1.0}
    monkeypatch.setattr(timing, "machine", lambda: "another")
    assert timing._first_recorded() == {}
