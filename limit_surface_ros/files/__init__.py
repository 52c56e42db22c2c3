# SPDX-License-Identifier: Apache-2.0
"""Model and data files to validated objects, and back."""
