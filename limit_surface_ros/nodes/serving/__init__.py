# SPDX-License-Identifier: Apache-2.0
"""How a node serves: settings, endpoints that may wait or fail, health, and an orderly end."""
