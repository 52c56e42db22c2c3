# SPDX-License-Identifier: Apache-2.0
"""Gauges: positive functions, homogeneous of degree one: how far out a load or motion lies."""
