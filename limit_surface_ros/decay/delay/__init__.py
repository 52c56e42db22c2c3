# SPDX-License-Identifier: Apache-2.0
"""Chapter 2 of the thesis: from a response to its delay system and the roots of that."""
