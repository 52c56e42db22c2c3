# SPDX-License-Identifier: Apache-2.0
"""Where the fits of a catalogue run: processes of this machine, or a running Dask cluster."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros import __version__
from limit_surface_ros.errors import ClusterError, MissingExtraError, RangeError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor

# Jobs handed to a cluster at a time: enough for some hundred workers, little for its scheduler.
CLUSTER_IN_FLIGHT = 1000
# Such as tcp://host:8786: Dask tries anything else for half a minute.
_ADDRESS = re.compile(r"([a-z]+://)?[^/\s]+:[0-9]+/?")
_CONNECT_TIME = 10.0
_WORKER_TIME = 30.0


def check_address(address: str) -> None:
    """Refuse what cannot be the address of a scheduler.

    Raises:
        RangeError: It is not like tcp://host:8786.
    """
    if not _ADDRESS.fullmatch(address):
        raise RangeError(
            f"--dask must be a scheduler's address with its port, such as tcp://host:8786, "
            f"got {address!r}"
        )


@contextlib.contextmanager
def dask_executor(address: str, folder: Path) -> Iterator[Executor]:
    """Give the executor of the Dask cluster whose scheduler is at `address`.

    Args:
        address: Such as tcp://host:8786.
        folder: What every worker must be able to read, as an absolute path.

    Raises:
        MissingExtraError: Dask's distributed is not installed.
        ClusterError: There is no scheduler or no worker, or a worker has another version of this
            package or does not see the folder.
    """
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtraError("distributed", "cluster") from None
    # Its own lines on lost workers and closed connections tell users nothing that we do not.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=_CONNECT_TIME, set_as_default=False)
    except (OSError, ValueError, asyncio.TimeoutError) as error:
        raise ClusterError(f"no Dask scheduler answers at {address}: {error}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_WORKER_TIME)
        except asyncio.TimeoutError:
            raise ClusterError(f"the Dask cluster at {address} has no worker") from None
        found = client.run(complaint, __version__, str(folder), on_error="return")
        for worker, trouble in found.items():
            if trouble:
                raise ClusterError(f"the Dask worker {worker} cannot take part: {trouble}")
        yield client.get_executor(pure=False)


def complaint(version: str, folder: str) -> str:
    """Return what keeps the process that is asked from taking part, or nothing."""
    if version != __version__:
        return f"it has limit_surface_ros {__version__}, this program is of {version}"
    if not Path(folder).is_dir():
        return f"it does not see {folder}: workers need the folder under the same path"
    return ""
