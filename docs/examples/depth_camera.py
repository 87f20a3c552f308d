"""A depth camera in the loop: its image becomes a point cloud, the cloud an obstacle.

The camera is synthetic: rays are cast at a shelf and at a ball that comes through the arm's way, at 10 Hz with 2 mm of
noise. What moves is told from what stands by comparing two images; its velocity is that of its points' mean. The filter
never sees the shapes; coal judges by them.

The arm itself is not in this image. With a real camera, remove it first: drop the points within a centimetre or two of
the robot's own surface.

    python docs/examples/depth_camera.py
"""

import numpy as np

import cdfctl
from cdfctl.simulation.clearance import nearest  # coal, on the true shapes

DT = 0.02  # s
EVERY = 5  # control steps an image
SECONDS = 3.0
WIDTH, HEIGHT, FOCAL = 80, 60, 70.0  # pixels
EYE = np.array([1.6, 0.0, 1.1])  # m, the camera's place; it looks at LOOK_AT
LOOK_AT = np.array([0.4, 0.0, 0.45])
BALL_RADIUS = 0.1
SHELF_SIZE, SHELF_AT = np.array([0.2, 0.5, 0.04]), np.array([0.55, -0.45, 0.5])
VOXEL = 0.03  # m
NEVER = np.inf


def camera_axes() -> np.ndarray:
    """Rotation (3, 3) from the camera (x right, y down, z ahead) to the world."""
    ahead = (LOOK_AT - EYE) / np.linalg.norm(LOOK_AT - EYE)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(ahead, right), ahead])


AXES = camera_axes()
COLUMNS, ROWS = np.meshgrid(np.arange(WIDTH) - WIDTH / 2 + 0.5, np.arange(HEIGHT) - HEIGHT / 2 + 0.5)
RAYS = np.stack([COLUMNS / FOCAL, ROWS / FOCAL, np.ones_like(COLUMNS)], axis=-1) @ AXES.T  # depth 1 along the axis


def ball_at(t: float) -> np.ndarray:
    return np.array([0.36, 0.8 - 0.5 * t, 0.6])


def depth_image(t: float, rng: np.random.Generator) -> np.ndarray:
    """Depth (HEIGHT, WIDTH) in m, infinite where a ray hits nothing."""
    centre = EYE - ball_at(t)
    a, b, c = (RAYS**2).sum(-1), (RAYS @ centre), centre @ centre - BALL_RADIUS**2
    root = b**2 - a * c
    ball = np.where(root > 0.0, (-b - np.sqrt(np.maximum(root, 0.0))) / a, NEVER)
    sides = np.stack([(SHELF_AT + s * SHELF_SIZE / 2 - EYE) / RAYS for s in (-1, 1)])
    enter, leave = sides.min(0).max(-1), sides.max(0).min(-1)
    shelf = np.where(enter < leave, enter, NEVER)
    return np.minimum(ball, shelf) + rng.normal(0.0, 0.002, ball.shape)


def points_of(depth: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The masked pixels as points (k, 3) in the world, at most one in a voxel."""
    points = EYE + RAYS[mask] * depth[mask][:, None]
    _, first = np.unique(np.floor(points / VOXEL), axis=0, return_index=True)
    return points[first]


def clouds(depth: np.ndarray, before: np.ndarray) -> list[cdfctl.Obstacle]:
    """The image as obstacles: what stood still since the image before it, and what moved."""
    seen = np.isfinite(depth)
    with np.errstate(invalid="ignore"):  # nothing seen in either image
        moved = seen & ~(np.abs(depth - before) < 0.02)
    found = []
    if (seen & ~moved).any():
        cloud = cdfctl.PointCloud(points_of(depth, seen & ~moved), radius=VOXEL / 2)
        found.append(cdfctl.Obstacle(cloud, [0, 0, 0], name="standing"))
    if moved.sum() > 8:
        velocity = np.zeros(3)
        with np.errstate(invalid="ignore"):
            gone = np.isfinite(before) & ~(np.abs(depth - before) < 0.02)
        if gone.sum() > 8:
            shift = points_of(depth, moved).mean(axis=0) - points_of(before, gone).mean(axis=0)
            velocity = shift / (EVERY * DT)
        # A camera sees the near side only: the ball behind it is a guess, here a thicker skin.
        cloud = cdfctl.PointCloud(points_of(depth, moved), radius=0.06)
        found.append(cdfctl.Obstacle(cloud, [0, 0, 0], velocity=velocity, name="moving"))
    return found


def main() -> None:
    robot = cdfctl.load_robot("franka", acceleration_limits=20.0)
    safe = cdfctl.SafetyFilter(robot, "sdf-tvcbf-qp", dt=DT, links="all", alpha=3.0, margin=0.04, self_collision=6)
    rng = np.random.default_rng(0)
    shapes = cdfctl.Sphere(BALL_RADIUS), cdfctl.Box(tuple(SHELF_SIZE))
    q, least, most_points = robot.home.copy(), np.inf, 0
    before, measured = depth_image(0.0, rng), []
    for k in range(int(SECONDS / DT)):
        t = k * DT
        if k % EVERY == 0:
            depth = depth_image(t, rng)
            measured, before = clouds(depth, before), depth
        age = k % EVERY * DT
        scene = cdfctl.Scene(
            [
                cdfctl.Obstacle(o.shape, o.position + age * o.velocity, velocity=o.velocity, name=o.name)
                for o in measured
            ]
        )
        most_points = max(most_points, sum(len(o.shape.points) for o in measured))
        u_nominal = 1.0 * (robot.home - q) + [0.4 * np.sin(1.5 * t), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        q = q + DT * safe.step(q, scene, u_nominal).u
        true = cdfctl.Scene(
            [
                cdfctl.Obstacle(shapes[0], ball_at(t + DT), name="ball"),
                cdfctl.Obstacle(shapes[1], SHELF_AT, name="shelf"),
            ]
        )
        least = min(least, nearest(robot, q, true).distance)
    print(f"images: {-(-k // EVERY)}, of up to {most_points} points; steps: {dict(safe.counts)}")
    print(f"least clearance to the true shapes, by coal: {1e3 * least:.1f} mm")


if __name__ == "__main__":
    main()
