"""A scenario as YAML text that loads back to an equal scenario, every float exact."""

from __future__ import annotations

import math
from typing import Any

import yaml

from cdfctl.scenario.feed import collapse
from cdfctl.scenario.schema import Scenario
from cdfctl.scenario.yaml_loader import scalar


class _Dumper(yaml.SafeDumper):
    """Text that any YAML reader takes for text, numbers that any takes for the same number."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _number(dumper: yaml.SafeDumper, value: float) -> yaml.ScalarNode:
    text = repr(value)
    mantissa, e, exponent = text.partition("e")
    if e and "." not in mantissa:
        # YAML 1.1 readers take 1e-05 for text.
        text = f"{mantissa}.0e{exponent}"
    assert math.isfinite(value)
    return dumper.represent_scalar("tag:yaml.org,2002:float", text)


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    try:
        plain = isinstance(scalar(value), str)
    except ValueError:
        plain = False
    style = None if plain and "\n" not in value else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)


def _list(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.SequenceNode:
    short = all(not isinstance(item, str | dict) or _is_draw(item) for item in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=short)


def _mapping(dumper: yaml.SafeDumper, value: dict[str, Any]) -> yaml.MappingNode:
    return dumper.represent_mapping("tag:yaml.org,2002:map", value.items(), flow_style=_is_draw(value) or not value)


def _is_draw(value: object) -> bool:
    return isinstance(value, dict) and "uniform" in value


_Dumper.add_representer(float, _number)
_Dumper.add_representer(str, _text)
_Dumper.add_representer(list, _list)
_Dumper.add_representer(dict, _mapping)


def dump(scenario: Scenario) -> str:
    """YAML text of ``scenario``: every field that has a value, in the order of the schema."""
    data = collapse(scenario.model_dump(mode="json", exclude_none=True))
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=110)
