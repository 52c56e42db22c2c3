# SPDX-License-Identifier: Apache-2.0
"""Limit surfaces of sliding bodies and decay models: fitted offline, served over ROS 2.

Layers, lowest first: `errors` and `checks`, then `surface`, `fitting`, `decay`, `files`, then
`nodes`, `tools` and `plots`. A module imports only from layers below its own; only `nodes`
imports rclpy. See docs/architecture.md.
"""

__version__ = "0.2.0"
