# SPDX-License-Identifier: Apache-2.0
"""What bodies do: how they move when they are pushed, slide and rest."""
