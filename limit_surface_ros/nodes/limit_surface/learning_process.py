# SPDX-License-Identifier: Apache-2.0
"""What runs in the process that learns: pushes in, models out. It knows no ROS.

A push is learnt in some 10 ms, and how sure the model then is takes as long again: in a thread of
the node that would hold Python's lock, and each request would wait for it. The process is a worker
of `fitting.workers`, which ends with its parent; what it has learnt is in the models that it
returns, so that another can go on from the last of them.
"""

from __future__ import annotations

import datetime
import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from limit_surface_ros import __version__
from limit_surface_ros.checks import counted
from limit_surface_ros.fitting.few_pushes.online import OnlineSurface

if TYPE_CHECKING:
    from collections.abc import Mapping

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.fitting.few_pushes.online import Update


@dataclass(frozen=True, eq=False)
class Learnt:
    """What became of a push.

    Attributes:
        update: Whether it was learnt, and how well it was predicted before.
        model: What is predicted now; None if it was not learnt.
        count: Pushes that were learnt so far.
    """

    update: Update
    model: SurfaceModel | None
    count: int


@dataclass(frozen=True, eq=False)
class _Learning:
    """What a process learns from, and what it has learnt.

    Attributes:
        prior: The model that it began with.
        name: Of the model that is learnt.
        online: What learns.
    """

    prior: SurfaceModel
    name: str
    online: OnlineSurface

    def model(self) -> SurfaceModel:
        """Return what is learnt, ready to be asked."""
        surface, scatter = self.online.surface_and_scatter()
        about: dict[str, Any] = {
            "objective": f"learnt push by push, {counted(self.online.count, 'push')}",
            "prior": self.prior.name,
            "online": self.online.state(),
            "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
            "version": __version__,
        }
        if scatter is not None:
            about["uncertainty"] = scatter.stored()
        model = replace(self.prior, name=self.name, surface=surface, fit=about)
        # Looked at here, and not by the first request that needs it.
        _ = model.convexity
        if model.uncertain is not None:
            model.uncertain.prepare()
        return model


_NICENESS = 10
_learning: _Learning | None = None


def begin(
    prior: SurfaceModel, name: str, forgetting: float | str, state: Mapping[str, Any] | None
) -> SurfaceModel | None:
    """Begin with a prior, or where a `state` stands; return what is known already, if anything.

    Raises:
        DataError: The state is none.
    """
    global _learning
    # What is learnt can wait, requests cannot: they have the cores first.
    os.nice(_NICENESS)
    if state is None:
        online = OnlineSurface(prior.surface, forgetting=forgetting)
    else:
        online = OnlineSurface.restored(state, prior.surface, forgetting=forgetting)
    _learning = _Learning(prior, name, online)
    return _learning.model() if online.count else None


def learn(wrench: Floats, twist: Floats) -> Learnt:
    """Learn a push.

    Raises:
        LimitSurfaceError: It is none that can be learnt.
    """
    assert _learning is not None
    update = _learning.online.add(wrench, twist)
    model = _learning.model() if update.accepted else None
    return Learnt(update, model, _learning.online.count)
