# SPDX-License-Identifier: Apache-2.0
"""Limit surfaces of sliding bodies and decay models: fitted to data, served over ROS 2.

Layers, lowest first: `errors`, `checks` and their like, then `surface`, `decay`, `motion`,
`fitting`, `files`, `export`, then `nodes`, `plots`, `thesis` and `tools`. A module imports only
from its own layer and those below; only `nodes` imports rclpy. See docs/architecture.md.
"""

__version__ = "0.2.0"
