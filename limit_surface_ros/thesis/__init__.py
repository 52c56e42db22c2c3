# SPDX-License-Identifier: Apache-2.0
"""The figures of the thesis's chapters 2 and 3, rebuilt, and what lies beyond them."""
