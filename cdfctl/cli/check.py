"""``cdfctl check``: validate a scenario, and do nothing else."""

from __future__ import annotations


def check(): ...
