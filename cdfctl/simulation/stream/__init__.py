"""Obstacles measured while a run goes on: one JSON object a line, from standard input or a UDP port."""
