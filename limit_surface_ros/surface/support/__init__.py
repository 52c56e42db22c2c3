# SPDX-License-Identifier: Apache-2.0
"""Support functions and support points of surfaces: the inverse of their normal maps."""
