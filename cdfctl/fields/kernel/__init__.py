"""The compiled geometry kernel: signed distances of a moving robot from moving obstacles, with their derivatives.

Read it in this order:

1. ``sets``: every piece of geometry is vertices (+) disc (+) ball, packed into arrays, with one support function;
2. ``simplex``, ``gjk``, ``epa``: distance and depth of two such sets;
3. ``distance``: the two joined into one signed distance with witness points and a normal;
4. ``body``, ``parts``: the robot's kinematics, the obstacles' poses and twists, and the derivatives they give;
5. ``rows``: the rows of the signed distance field.

``vec`` is the arithmetic of three-vectors, ``jit`` the compiler. Nothing here allocates memory once compiled (the
compiler is told to refuse it); workspaces are made once and passed in. Nothing is remembered between calls.
"""
