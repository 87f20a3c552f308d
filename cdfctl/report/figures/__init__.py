"""Figures of runs, benchmarks and the method. One concept a file:

- ``style``, ``part``, ``output``: how a figure looks, what it is made of, how it is written
- ``run_view``: a run folder as figures need it; ``task_space``, ``joint_space``, ``time_course``, ``animation`` show it
- ``bench_view``: a benchmark's store; ``bench_panels``, ``sweep`` show it
- ``field_map``, ``levels``, ``avoidance``, ``reaching``: the fields over two joints, and the paper's figures
"""
