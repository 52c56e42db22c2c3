# SPDX-License-Identifier: Apache-2.0
"""Parts of the `decay` node: onsets, their streams, and what slides or slips by them."""
