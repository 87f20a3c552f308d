"""Contact tables: what ``cdfctl build-cdf`` makes, and where the contact search of a cold query starts.

Read it in this order:

1. ``grid``: the points of the workspace a table has entries for;
2. ``contacts``: the compiled search for contacts of the robot with a ball at one point;
3. ``build``, ``partial``: the search over all points, in threads, that goes on after an interrupt;
4. ``file``, ``store``: one safetensors file, and what is checked before it is believed;
5. ``accuracy``: what a table is worth, measured on points it was not built for;
6. ``proposals``: starts moved near contact in batches by torch, on a GPU if there is one.
"""
