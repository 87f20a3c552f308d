"""Brute-force truth of the configuration-space distance: made once, stored beside this file, read by the tests.

It shares no code with the field: kinematics and Jacobians by Pinocchio, distances by coal, each local problem

    min ||x - q||  s.t.  f_g(x) = 0  (q free)      or      f_g(x) >= 0 for every g  (q in penetration),   limits on x

by SciPy's SLSQP from many random starts, for every collision geometry g. The least over all of them is the truth (an
upper bound of it, to be strict; ``--starts`` says how hard it was looked for).

    python tests/fields/truth/make_cdf_truth.py franka --pairs 48 --starts 150
"""

from __future__ import annotations

import argparse
import json
import os
import platform
from importlib.metadata import version
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
from joblib import Parallel, delayed
from scipy.optimize import minimize

from cdfctl import load_robot

HERE = Path(__file__).parent
SHAPES = {
    "ball": lambda rng: {"type": "ball", "radius": float(rng.uniform(0.03, 0.12))},
    "box": lambda rng: {"type": "box", "size": rng.uniform(0.05, 0.3, 3).tolist()},
    "capsule": lambda rng: {
        "type": "capsule",
        "radius": float(rng.uniform(0.03, 0.1)),
        "length": float(rng.uniform(0.1, 0.4)),
    },
    "cylinder": lambda rng: {
        "type": "cylinder",
        "radius": float(rng.uniform(0.03, 0.1)),
        "length": float(rng.uniform(0.1, 0.4)),
    },
}


def coal_shape(shape: dict) -> coal.CollisionGeometry:
    if shape["type"] == "ball":
        return coal.Sphere(shape["radius"])
    if shape["type"] == "box":
        return coal.Box(*shape["size"])
    if shape["type"] == "capsule":
        return coal.Capsule(shape["radius"], shape["length"])
    return coal.Cylinder(shape["radius"], shape["length"])


class Pair:
    """f_g(x) and its gradient for one obstacle at rest, by Pinocchio and coal."""

    def __init__(self, name: str, obstacle: dict) -> None:
        self.robot = load_robot(name)
        self.data = self.robot.model.createData()
        self.shape = coal_shape(obstacle["shape"])
        rotation = pin.Quaternion(*[obstacle["orientation"][i] for i in (3, 0, 1, 2)]).toRotationMatrix()
        self.pose = coal.Transform3s(rotation, np.array(obstacle["position"]))
        self.geometries = [g for g in self.robot.geometry.geometryObjects if g.parentJoint > 0]
        self.request = coal.DistanceRequest(True, True)
        self.request.gjk_tolerance = 1e-10
        self.request.epa_tolerance = 1e-10
        self.lower = np.where(np.isfinite(self.robot.lower), self.robot.lower, -np.pi)
        self.upper = np.where(np.isfinite(self.robot.upper), self.robot.upper, np.pi)

    def distance(self, index: int, x: np.ndarray) -> tuple[float, np.ndarray]:
        model, data, g = self.robot.model, self.data, self.geometries[index]
        pin.computeJointJacobians(model, data, x)
        placement = data.oMi[g.parentJoint] * g.placement
        result = coal.DistanceResult()
        d = coal.distance(
            g.geometry,
            coal.Transform3s(placement.rotation, placement.translation),
            self.shape,
            self.pose,
            self.request,
            result,
        )
        a = result.getNearestPoint1()
        normal = result.normal
        jacobian = pin.getJointJacobian(model, data, g.parentJoint, pin.LOCAL_WORLD_ALIGNED)
        arm = a - data.oMi[g.parentJoint].translation
        return d, -(normal @ (jacobian[:3] - pin.skew(arm) @ jacobian[3:]))

    def all_distances(self, x: np.ndarray) -> np.ndarray:
        return np.array([self.distance(i, x)[0] for i in range(len(self.geometries))])


def brute_force(name: str, q: np.ndarray, obstacle: dict, starts: int, seed: int) -> dict:
    rng = np.random.default_rng(seed)
    pair = Pair(name, obstacle)
    n = pair.robot.n
    bounds = list(zip(pair.lower, pair.upper, strict=True))
    penetrating = bool(pair.all_distances(q).min() < 0.0)
    best, best_x = np.inf, None
    problems = [None] if penetrating else list(range(len(pair.geometries)))
    for g in problems:
        indices = range(len(pair.geometries)) if g is None else [g]
        constraint = {
            "type": "ineq" if g is None else "eq",
            "fun": lambda x, i=indices: np.array([pair.distance(k, x)[0] for k in i]),
            "jac": lambda x, i=indices: np.array([pair.distance(k, x)[1] for k in i]),
        }
        for s in range(starts):
            if s == 0:
                x0 = q
            elif s % 3 == 1:
                x0 = np.clip(q + rng.normal(0.0, 0.4, n), pair.lower, pair.upper)
            else:
                x0 = rng.uniform(pair.lower, pair.upper)
            answer = minimize(
                lambda x: 0.5 * float((x - q) @ (x - q)),
                x0,
                jac=lambda x: x - q,
                bounds=bounds,
                constraints=[constraint],
                method="SLSQP",
                options={"maxiter": 60, "ftol": 1e-10},
            )
            x = np.clip(answer.x, pair.lower, pair.upper)
            distance = float(np.linalg.norm(x - q))
            if distance < best - 1e-9:
                f = constraint["fun"](x)
                if (f.min() > -1e-6) if g is None else (abs(f[0]) < 1e-6):
                    best, best_x = distance, x
    found = best_x is not None
    return {
        "q": q.tolist(),
        "obstacle": obstacle,
        "penetrating": penetrating,
        "d": (-best if penetrating else best) if found else None,
        "contact_q": best_x.tolist() if found else None,
    }


def random_pair(name: str, index: int, seed: int) -> tuple[np.ndarray, dict]:
    """Pairs in reach; every sixth is drawn until the arm is in penetration, the others until it is clear."""
    rng = np.random.default_rng([seed, index])
    robot = load_robot(name)
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    kind = ("ball", "ball", "box", "ball", "capsule", "cylinder")[index % 6]
    while True:
        direction = rng.normal(size=3)
        position = np.array([0.0, 0.0, 0.35]) + direction / np.linalg.norm(direction) * rng.uniform(0.25, 0.8)
        orientation = rng.normal(size=4)
        obstacle = {
            "shape": SHAPES[kind](rng),
            "position": position.tolist(),
            "orientation": (orientation / np.linalg.norm(orientation)).tolist(),
        }
        q = rng.uniform(lower, upper)
        least = Pair(name, obstacle).all_distances(q).min()
        if (least < -0.005) if index % 6 == 3 else (least > 0.01):
            return q, obstacle


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot", nargs="?", default="franka")
    parser.add_argument("--pairs", type=int, default=48)
    parser.add_argument("--starts", type=int, default=150)
    parser.add_argument("--seed", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    pairs = [random_pair(arguments.robot, i, arguments.seed) for i in range(arguments.pairs)]
    rows = Parallel(n_jobs=arguments.jobs, verbose=5)(
        delayed(brute_force)(arguments.robot, q, obstacle, arguments.starts, arguments.seed + i)
        for i, (q, obstacle) in enumerate(pairs)
    )
    document = {
        "made_by": f"tests/fields/truth/make_cdf_truth.py {arguments.robot} --pairs {arguments.pairs} "
        f"--starts {arguments.starts} --seed {arguments.seed}",
        "robot_hash": load_robot(arguments.robot).hash,
        "versions": {p: version(p) for p in ("pin", "coal", "scipy", "numpy")} | {"python": platform.python_version()},
        "pairs": rows,
    }
    path = HERE / f"{arguments.robot}_cdf.json"
    path.write_text(json.dumps(document, indent=1) + "\n")
    print(f"{len(rows)} pairs -> {path}")


if __name__ == "__main__":
    main()
