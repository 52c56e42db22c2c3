# SPDX-License-Identifier: Apache-2.0
"""Run pytest on the package as it is installed: the working directory is not importable here."""

import sys

import pytest

if __name__ == "__main__":
    sys.exit(pytest.main())
