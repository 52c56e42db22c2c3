# SPDX-License-Identifier: Apache-2.0
"""Models that leave Python: one fixed module text for each target, and the model's arrays."""
