"""Settings of the whole test suite."""

from hypothesis import HealthCheck, settings

# Kernels compile at their first call, so the time of one example says nothing; the same examples in every run.
settings.register_profile(
    "cdfctl", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.load_profile("cdfctl")
