# SPDX-License-Identifier: Apache-2.0
"""Fits to few, noisy pushes: recipes, their choice, and what the data leave open."""
