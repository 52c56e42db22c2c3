# SPDX-License-Identifier: Apache-2.0
"""Offline fits of limit surfaces to pairs of wrench and twist; never imported by a node."""
