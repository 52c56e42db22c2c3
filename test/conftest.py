"""Settings that all tests share."""

from hypothesis import settings

# The same examples on every run, and no verdict on a busy machine's speed.
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("repeatable")
