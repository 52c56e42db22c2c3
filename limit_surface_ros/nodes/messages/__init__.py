# SPDX-License-Identifier: Apache-2.0
"""Messages to checked planar numbers in the frame of a model, and back."""
