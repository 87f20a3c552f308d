"""The compiled kernel: distances of a moving robot from moving obstacles, in metres and in radians, with derivatives.

Read it in this order:

1. ``sets``: every piece of geometry is vertices (+) disc (+) ball, packed into arrays, with one support function;
2. ``simplex``, ``gjk``, ``epa``: distance and depth of two such sets;
3. ``distance``: the two joined into one signed distance with witness points and a normal;
4. ``body``, ``parts``: the robot's kinematics, the obstacles' poses and twists, and the derivatives they give;
5. ``rows``: the rows of the signed distance field;
6. ``projection``, ``quadratic``, ``curvature``, ``contact``: the nearest contact configuration from one start;
7. ``starts``, ``candidates``, ``pieces``, ``finish``, ``search``: from many starts to the nearest contacts of an
   obstacle;
8. ``escape``: the way out of penetration;
9. ``cdf_rows``: the rows of the configuration-space distance field.

``vec`` is the arithmetic of three-vectors, ``joints`` that of configurations, ``structs`` how arrays are passed and
``jit`` the compiler. Nothing here allocates memory once compiled (the compiler is told to refuse it); workspaces are
made once and passed in. Between calls only the contacts in a ``memory.Memory`` are remembered.
"""
