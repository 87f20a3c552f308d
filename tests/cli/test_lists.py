"""``robots``, ``scenarios``, ``schema`` and ``doctor``."""

from __future__ import annotations

import jsonschema
import pytest
import yaml

from cdfctl.cli.console import finite
from cdfctl.report import speed, stack
from cdfctl.scenario.library import scenarios_dir

ROBOTS = {"planar", "franka", "ur5", "ur10", "xarm7", "kinova", "z1"}
SCENARIOS = {"S1", "S2", "S3", "C1", "C2", "C3", "planar-1", "reach", "reach-collinear"}


@pytest.mark.parametrize(("command", "names"), [("robots", ROBOTS), ("scenarios", SCENARIOS)])
def test_a_list_names_everything_shipped(cli, command, names):
    shown = cli(command)
    assert (shown.status, shown.err) == (0, "")
    assert max(map(len, shown.out.splitlines())) <= 80
    document = cli(command, "--json").document()[command]
    assert {item["name"] for item in document} >= names
    assert all(item["description"] for item in document)
    assert set(cli(command, "--quiet").out.split()) == {item["name"] for item in document}
    for name in names:
        assert f"\n{name} " in shown.out


def test_schema_accepts_every_shipped_scenario_and_refuses_a_typo(cli):
    schema = cli("schema").document()
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for path in scenarios_dir().glob("*.yaml"):
        document = yaml.safe_load(path.read_text())
        validator.validate(document)
        with pytest.raises(jsonschema.ValidationError):
            validator.validate({**document, "velocty": 1})


def test_doctor_reports_the_stack(cli):
    shown = cli("doctor")
    assert shown.status == 0
    document = cli("doctor", "--json").document()
    assert document["healthy"] is True
    assert {"daqp", "clarabel"} <= set(document["solvers"])
    assert document["packages"]["pin"].startswith("4.")
    assert document["torch"] == (document["packages"]["torch"] is not None)
    for word in ("pin", "coal", "QP solvers", "CDF tables", "cache"):
        assert word in shown.out


def test_doctor_says_what_is_missing_and_what_mends_it(cli, monkeypatch, tmp_path):
    block = tmp_path / "file"
    block.write_text("")
    monkeypatch.setenv("CDFCTL_CACHE", str(block / "cache"))
    monkeypatch.setattr(stack, "NEEDED", {**stack.NEEDED, "no-such-package": "no_such_package"})
    monkeypatch.setattr(stack, "OPTIONAL", {"torch": "tables", "also-missing": "nothing"})
    result = cli("doctor")
    assert result.status == 3
    assert "missing  no-such-package is not installed" in result.out
    assert "python -m pip install 'no-such-package'" in result.out
    assert "optional  also-missing, for nothing" in result.out
    assert "CDFCTL_CACHE" in result.out
    quiet = cli("doctor", "--quiet")
    assert (quiet.status, quiet.out) == (3, "")
    assert "no-such-package" in quiet.err


def test_doctor_notices_a_package_that_does_not_import(cli, monkeypatch):
    monkeypatch.setattr(stack, "NEEDED", {**stack.NEEDED, "coal": "no_such_module"})
    document = cli("doctor", "--json").document()
    assert document["healthy"] is False
    (item,) = [item for item in document["missing"] if item["needed"]]
    assert "import fails" in item["what"]
    assert item["mend"].startswith("python -m pip install 'coal")


def test_doctor_lists_tables(monkeypatch, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "franka.safetensors").write_bytes(b"")
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path))
    assert stack.examine().tables == ("franka.safetensors",)


def test_numbers_that_are_not_finite_become_null():
    nan, inf = float("nan"), float("inf")
    assert finite({"a": [nan, 1.0, (inf,)], "b": {"c": -inf, "d": "x"}, "e": True}) == {
        "a": [None, 1.0, [None]],
        "b": {"c": None, "d": "x"},
        "e": True,
    }


def test_doctor_times_the_control_step(cli, monkeypatch):
    monkeypatch.setattr(speed, "STEPS", 3)
    monkeypatch.setattr(speed, "WARM_UP", 1)
    document = cli("doctor", "--speed", "--json").document()
    assert [(timing["robot"], timing["obstacles"]) for timing in document["speed"]] == [("franka", 6), ("franka", 50)]
    assert all(0.0 < timing["step_ms"]["p50"] <= timing["step_ms"]["p99"] for timing in document["speed"])
    shown = cli("doctor", "--speed")
    assert shown.status == 0
    assert "dual-tvcbf-qp  " in shown.out
    assert " ms" in shown.out
