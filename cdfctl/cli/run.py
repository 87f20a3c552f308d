"""``cdfctl run``"""

from __future__ import annotations


def run(): ...
