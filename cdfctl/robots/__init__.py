"""The body: a robot file and a URDF become a Pinocchio model, coal geometry and plain arrays for kernels."""
