# SPDX-License-Identifier: Apache-2.0
"""What the programs share: options and their checks, inputs, fits, and how a program runs."""
