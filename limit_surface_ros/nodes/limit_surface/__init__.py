# SPDX-License-Identifier: Apache-2.0
"""Parts of the `limit_surface` node: pushes along paths, learning, markers."""
