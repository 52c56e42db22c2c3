# SPDX-License-Identifier: Apache-2.0
"""Settings of Fast DDS: a stream is not to wait for a message that a long answer displaced."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rclpy.utilities import get_rmw_implementation_identifier

if TYPE_CHECKING:
    from collections.abc import Iterator

# What Fast DDS 2 reads when the first node of a process is made, and the file that it finds by
# itself; other middlewares look at neither.
VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_FOUND = "DEFAULT_FASTRTPS_PROFILES.xml"
# By which a user chooses transports, which ours would take the place of.
_TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"


@contextlib.contextmanager
def settings() -> Iterator[None]:
    """Name config/fastdds.xml to nodes that are made in the block, if the user names no file."""
    theirs = os.environ.get(VARIABLE) or os.environ.get(_TRANSPORTS) or Path(_FOUND).exists()
    file = None if theirs else _shipped()
    if file is None:
        yield
        return
    os.environ[VARIABLE] = str(file)
    try:
        yield
    finally:
        del os.environ[VARIABLE]


def requests_wait_apart() -> bool:
    """Return whether nodes that are made now have queues of requests that the file gives a depth.

    Elsewhere a service has one depth for its requests and for the replies that it keeps.
    """
    file = _shipped()
    ours = file is not None and os.environ.get(VARIABLE) == str(file)
    return ours and get_rmw_implementation_identifier().startswith("rmw_fastrtps")


def _shipped() -> Path | None:
    with contextlib.suppress(PackageNotFoundError):
        file = Path(get_package_share_directory("limit_surface_ros")) / "config" / "fastdds.xml"
        return file if file.exists() else None
    return None
