# SPDX-License-Identifier: Apache-2.0
"""A headless browser that runs a page and tells what came of it."""

from __future__ import annotations

import shutil
import subprocess
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
# Without the last three it looks for hosts that a closed network does not have.
_FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]

needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no chromium on this machine; .ci/run installs it"
)


def document_of(page: Path, *flags: str, budget: int = 60_000) -> str:
    """Return a page's document once its scripts have run.

    Args:
        page: The page; the browser's profile goes beside it.
        flags: Further ones of the browser.
        budget: Time that the page may believe to pass [ms].
    """
    assert CHROMIUM is not None
    profile = f"--user-data-dir={page.parent / 'profile'}"
    time = f"--virtual-time-budget={budget}"
    command = [CHROMIUM, *_FLAGS, profile, time, *flags, "--dump-dom", page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
