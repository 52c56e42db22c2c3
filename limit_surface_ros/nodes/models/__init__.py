# SPDX-License-Identifier: Apache-2.0
"""The models of a node, and the node that holds them: the base of both nodes."""
