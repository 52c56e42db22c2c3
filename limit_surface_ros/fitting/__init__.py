# SPDX-License-Identifier: Apache-2.0
"""Fits of limit surfaces to pairs of wrench and twist; of it a node imports the learner alone."""
