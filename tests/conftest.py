"""Settings of the whole test suite."""

import atexit
import os
import shutil
import signal
import tempfile
from pathlib import Path

from hypothesis import HealthCheck, settings

from cdfctl.cache import cache_dir, writable_dir

# Kernels compile at their first call, so the time of one example says nothing; the same examples in every run.
settings.register_profile(
    "cdfctl", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.load_profile("cdfctl")


def _lend_kernels() -> None:
    """A cache of the tests' own, but for the compiled kernels: a contact table of the user's would change answers."""
    kernels = writable_dir(cache_dir() / "kernels")
    own = Path(tempfile.mkdtemp(prefix="cdfctl-tests-"))
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    if kernels is not None:
        (own / "kernels").symlink_to(kernels.resolve(), target_is_directory=True)
    os.environ["CDFCTL_CACHE"] = str(own)


_lend_kernels()

# A shell starts what it puts into the background with SIGINT ignored, and children inherit that: the commands that the
# tests interrupt would go on.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
