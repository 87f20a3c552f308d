"""What can be solved at all: bounds by reachability in (q1, q2, t), for robots with two joints.

Read it in this order: ``grid`` (the cells), ``cells`` (which of them are free at an instant), ``search`` (which can be
reached), ``bounds`` (what that proves of a trial).
"""
