"""Shapes as coal geometry, and coal geometry as convex sets.

coal keeps primitives exact, and a mesh becomes the convex solid of its hull: coal's own mesh type is a surface, and the
distance of a ball wholly inside a surface is positive.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cdfctl.robots.convex import ConvexSet, box_vertices, convex_hull, segment_vertices
from cdfctl.types import Array, Box, Capsule, ConvexMesh, Cylinder, IntArray, Shape, Sphere

# coal's default of 1e-6 leaves errors of up to 6e-3 in the direction of one distance in 25, at the same cost.
GJK_TOLERANCE = 1e-9
EPA_TOLERANCE = 1e-9
# coal's 64 leave 1 mm of error in the depth of a segment along a cylinder's axis.
EPA_ITERATIONS = 256


def coal_shape(shape: Shape) -> Any:
    """The coal geometry of an obstacle's shape, in the obstacle's frame; a point cloud is many and has none."""
    import coal

    match shape:
        case Sphere(radius):
            return coal.Sphere(radius)
        case Box(size):
            return coal.Box(*size)
        case Capsule(radius, length):
            return coal.Capsule(radius, length)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
        case ConvexMesh():
            return coal_convex(*convex_hull(shape.vertices))
    raise TypeError(f"no single coal geometry for {type(shape).__name__}")


def coal_convex(vertices: Array, faces: IntArray) -> Any:
    """A coal convex solid over hull ``vertices`` (k, 3) and outward ``faces`` (t, 3); a flat hull is two-sided."""
    import coal

    if faces.shape[0] == 0:
        faces = _flat_faces(vertices)
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in vertices:
        points.append(vertex)
    for face in faces:
        triangles.append(coal.Triangle(int(face[0]), int(face[1]), int(face[2])))
    return coal.Convex(points, triangles)


def _flat_faces(vertices: Array) -> IntArray:
    """Both sides of a fan over the corners of a flat polygon, in the order of their angle."""
    centred = vertices - vertices.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    around = np.argsort(np.arctan2(centred @ axes[1], centred @ axes[0]))
    fan = np.array([[around[0], around[i], around[i + 1]] for i in range(1, len(around) - 1)], dtype=np.int64)
    return np.concatenate([fan, fan[:, ::-1]]) if len(fan) else np.array([[0, 0, len(vertices) - 1]], dtype=np.int64)


def convex_form(geometry: Any) -> tuple[Any, ConvexSet, IntArray]:
    """A collision geometry of a URDF as (coal geometry that is convex or primitive, the same as a set, hull faces)."""
    import coal

    none = np.zeros((0, 3), dtype=np.int64)
    if isinstance(geometry, coal.Sphere):
        return geometry, ConvexSet(np.zeros((1, 3)), radius=geometry.radius), none
    if isinstance(geometry, coal.Capsule):
        return geometry, ConvexSet(segment_vertices(2.0 * geometry.halfLength), radius=geometry.radius), none
    if isinstance(geometry, coal.Cylinder):
        return geometry, ConvexSet(segment_vertices(2.0 * geometry.halfLength), disc=geometry.radius), none
    if isinstance(geometry, coal.Box):
        vertices, faces = convex_hull(box_vertices(2.0 * geometry.halfSide), keep=True)
        return geometry, ConvexSet(vertices), faces
    points = np.array(geometry.points() if isinstance(geometry, coal.Convex) else geometry.vertices())
    vertices, faces = convex_hull(points, keep=True)
    return coal_convex(vertices, faces), ConvexSet(vertices), faces


def exact_request(request: Any) -> Any:
    """``request``, a coal distance request, set to signed distances as exact as coal gives them."""
    request.gjk_tolerance, request.epa_tolerance = GJK_TOLERANCE, EPA_TOLERANCE
    request.epa_max_iterations = EPA_ITERATIONS
    request.enable_signed_distance = True
    return request


def bounding_ball(geometry: Any) -> Array:
    """Centre and radius (4,) of a ball that contains a geometry, in its frame."""
    import coal

    if isinstance(geometry, coal.Sphere):
        return np.array([0.0, 0.0, 0.0, geometry.radius])
    if isinstance(geometry, coal.Capsule):
        return np.array([0.0, 0.0, 0.0, geometry.radius + geometry.halfLength])
    if isinstance(geometry, coal.Cylinder):
        return np.array([0.0, 0.0, 0.0, np.hypot(geometry.radius, geometry.halfLength)])
    if isinstance(geometry, coal.Box):
        return np.array([0.0, 0.0, 0.0, np.linalg.norm(geometry.halfSide)])
    if isinstance(geometry, coal.Convex):
        points = np.array(geometry.points())
    elif geometry.num_vertices == 1:
        points = np.array([geometry.vertex(0)])  # vertices() hands a single one back as memory of something else
    else:
        points = np.array(geometry.vertices())
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())
