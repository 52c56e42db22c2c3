# SPDX-License-Identifier: Apache-2.0
"""What the programs that ask nodes share, and the parts of the demonstration."""
