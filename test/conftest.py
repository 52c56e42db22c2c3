"""Settings that all tests share."""

from hypothesis import settings

from limit_surface_ros.blas_threads import use_one_by_default

# Before numpy is imported: on a busy machine threads of BLAS make some tests fifteen times slower.
use_one_by_default()

# The same examples on every run, and no verdict on a busy machine's speed.
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("repeatable")
