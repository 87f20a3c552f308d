"""A scenario that uses both fields and takes a moment, for the tests that write its files."""

DUAL = """\
version: 1
name: small
robot: {name: planar, q0: [0.5, 0.5]}
task: {type: joint-goal, goal: [2.5, 0.4]}
obstacles:
  - {name: a, shape: {type: ball, radius: 0.3}, position: [1.0, {uniform: [2.6, 3.0]}, 0.0], velocity: [0.1, -1.0, 0.0]}
  - {name: "</script><img src=x>", shape: {type: box, size: [0.2, 0.3, 0.4]}, position: [-3.0, 0.5, 0.0]}
controller: {variant: dual-tvcbf-qp, on_infeasible: least-violation}
simulation: {dt: 0.05, time_limit: 0.4}
assumptions:
  - Made for a test.
"""
