# SPDX-License-Identifier: Apache-2.0
"""Decay models and their files.

A file is YAML::

    schema: 1
    kind: exponential_sum
    name: hockey_stick
    fit: {...}                         # optional: how the model came about
    system:                            # optional: the delay system whose roots the rates are
      delays: [0.0, 1.0]               # [s]
      strengths: [-1.0, 1.0]           # [1/s]
      edges: [0.0, 1.0, ...]           # optional: the distributed feedback's cells [s]
      legendre: [[...], ...]           # one row of coefficients for each cell
      neutral_delays: [1.3]            # optional: delayed derivatives [s]
      neutral_strengths: [0.2]         # optional: their strengths
    time_span: [0.0, 6.0]              # [s], where the error was measured
    norm: inf
    max_error: 0.0282                  # in the unit of x
    noise: 0.004                       # optional: standard deviation of the record's noise
    tail:                              # optional: after the time span
      envelope: 0.02                   # |response - constant| is assumed never to exceed this
      bound: 0.031                     # |x - constant| provably never does
      assumption: after 6 s ...        # the assumption in words
    rates: [[-2.05, 0.51], ...]        # [re, im] [1/s], one of each conjugate pair (im >= 0)
                                       # the rate [0, 0] is a constant, to which x decays
    coefficients: [[0.31, -0.2], ...]  # x(t) = Re sum c exp(lambda t)
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import as_floats, as_name
from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.tail import Tail
from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.section import Section, place_errors
from limit_surface_ros.files.yaml_reader import read_yaml, write_yaml

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

SCHEMA = 1
KIND = "exponential_sum"


@dataclass(frozen=True)
class DecayModel:
    """A sum of exponentials with its name, its error and its origin.

    Attributes:
        name: By which programs ask for it.
        sum: The function x(t); it decays to zero, or to a constant if a rate is 0.
        time_span: Start and end [s] of the interval on which `max_error` holds.
        norm: What the coefficients minimise: "inf", "2", "1" or a name of the analyst's own.
        max_error: Largest |x - response| on the time span, of a record at its samples, in the unit
            of x.
        system: The delay system whose roots the rates are, if they come from one.
        fit: How the model came about, as plain values for the file.
        tail: What is assumed of the response after the time span, and what the sum does there;
            None if nothing was stated.
        noise: Standard deviation of the noise of the record that was fitted; 0 if not stated.

    Raises:
        RangeError: The name is empty, too long or not printable, the span is not 0 <= start < end,
            the error is negative, or the sum does not decay.
    """

    name: str
    sum: ExponentialSum
    time_span: tuple[float, float]
    norm: str
    max_error: float
    system: DelaySystem | None = None
    fit: Mapping[str, Any] = field(default_factory=dict)
    tail: Tail | None = None
    noise: float = 0.0

    def __post_init__(self) -> None:
        """Check what the sum itself has not checked."""
        as_name("name", self.name)
        start, end = (float(t) for t in self.time_span)
        if not 0.0 <= start < end < float("inf"):
            raise RangeError(f"time_span must be 0 <= start < end, got {start} and {end}")
        if not 0.0 <= self.max_error < float("inf"):
            raise RangeError(f"max_error must be finite and at least 0, got {self.max_error}")
        if not self.sum.settles:
            raise RangeError(
                f"a decay model must decay: its right-most rate has the real part "
                f"{self.sum.slowest_rate:g}, which must be below 0 (the rate 0 is a constant)"
            )
        if not 0.0 <= self.noise < float("inf"):
            raise RangeError(f"noise must be finite and at least 0, got {self.noise}")
        object.__setattr__(self, "time_span", (start, end))
        object.__setattr__(self, "noise", float(self.noise))
        object.__setattr__(self, "max_error", float(self.max_error))

    def bounds(self, times: ArrayLike) -> Floats:
        """Return what |x - response| does not exceed at given times, as the file states it.

        On the time span the error that was measured there, of a record at its samples and not
        between them; after it, what the sum and the response may differ by if the response does
        as the tail assumes. Infinite where the file states nothing: before the span, and after it
        without a tail.

        Args:
            times: Any shape [s].

        Raises:
            NotFiniteError: A time is NaN or infinite.
        """
        t = as_floats("times", times)
        start, end = self.time_span
        after = np.inf if self.tail is None else max(self.tail.error, self.max_error)
        bounds: Floats = np.where(t < start, np.inf, np.where(t <= end, self.max_error, after))
        return bounds


def read_decay_model(path: str | Path) -> DecayModel:
    """Read a decay model.

    Raises:
        FileError: The file cannot be read or is no valid decay model; the message names the file,
            the key, what was found and what is accepted.
    """
    top = read_yaml(path)
    top.choice("schema", [SCHEMA])
    _refuse_surfaces(top)
    top.choice("kind", [KIND])
    name = top.name("name")
    rates, coefficients = (_complexes(top, key) for key in ("rates", "coefficients"))
    span = top.array("time_span", (2,))
    norm = top.text("norm")
    max_error = top.number("max_error", at_least=0.0)
    noise = top.number("noise", at_least=0.0) if "noise" in top else 0.0
    tail = _read_tail(top.section("tail")) if "tail" in top else None
    system = _read_system(top.section("system")) if "system" in top else top.raw("system", None)
    fit = dict(top.section("fit").values) if "fit" in top else top.raw("fit", None) or {}
    top.finish()
    x = place_errors(top, "rates", lambda: ExponentialSum(rates, coefficients))
    model: DecayModel = place_errors(
        top,
        "time_span" if x.settles else "rates",
        lambda: DecayModel(name, x, (span[0], span[1]), norm, max_error, system, fit, tail, noise),
    )
    return model


def write_decay_model(model: DecayModel, path: str | Path, header: str = "") -> None:
    """Write a decay model, atomically; read back it gives the same numbers bit for bit.

    Args:
        model: The model.
        path: The file, in a folder that exists.
        header: Lines of a comment at the top, such as the command that made the file.

    Raises:
        FileError: The file cannot be written.
    """
    values: dict[str, Any] = {"schema": SCHEMA, "kind": KIND, "name": model.name}
    if model.fit:
        values["fit"] = dict(model.fit)
    if model.system is not None:
        values["system"] = _system_values(model.system)
    if model.noise:
        values["noise"] = model.noise
    if model.tail is not None:
        values["tail"] = dataclasses.asdict(model.tail)
    # Last, and as long as each other: a file that was cut short anywhere is refused.
    values |= {
        "time_span": list(model.time_span),
        "norm": model.norm,
        "max_error": model.max_error,
        "rates": _rows(model.sum.rates),
        "coefficients": _rows(model.sum.coefficients),
    }
    write_yaml(path, values, header)


def _refuse_surfaces(top: Section) -> None:
    """Tell files of limit surfaces and of contacts where they belong."""
    if "characteristic_length" in top and "rates" not in top:
        raise top.error(
            "kind",
            "this is a limit surface, which the limit_surface node serves and plot_surface "
            f"draws; a decay model is of kind {KIND}",
        )
    if "kind" not in top and ("points" in top or "shape" in top):
        raise top.error(
            "kind", f"missing; this is a contact, for fit_surface; a decay model is of kind {KIND}"
        )


def _complexes(section: Section, key: str) -> Any:
    rows: Floats = section.array(key, (None, 2))
    # A view, and not re + 1j im, which would lose the sign of a zero.
    return np.ascontiguousarray(rows).view(np.complex128)[:, 0]


def _rows(values: Any) -> Floats:
    return np.stack([values.real, values.imag], axis=-1)


def _read_system(section: Section) -> DelaySystem:
    empty = np.zeros(0)
    delays = section.array("delays", (None,), empty)
    strengths = section.array("strengths", (None,), empty)
    edges = section.array("edges", (None,), None)
    series = section.array("legendre", (None, None), None)
    late = section.array("neutral_delays", (None,), empty)
    shares = section.array("neutral_strengths", (None,), empty)
    section.finish()
    if (edges is None) != (series is None):
        raise section.error("edges", "edges and legendre belong together: give both or none")
    pieces = None
    if edges is not None:
        pieces = place_errors(section, "edges", lambda: PiecewisePolynomial(edges, series))
    system: DelaySystem = place_errors(
        section, "delays", lambda: DelaySystem(delays, strengths, pieces, late, shares)
    )
    return system


def _read_tail(section: Section) -> Tail:
    envelope = section.number("envelope", at_least=0.0)
    bound = section.number("bound", at_least=0.0)
    assumption = section.text("assumption")
    section.finish()
    return Tail(envelope, bound, assumption)


def _system_values(system: DelaySystem) -> dict[str, Any]:
    values: dict[str, Any] = {}
    if len(system.delays):
        values |= {"delays": system.delays, "strengths": system.strengths}
    if len(system.neutral_delays):
        values |= {
            "neutral_delays": system.neutral_delays,
            "neutral_strengths": system.neutral_strengths,
        }
    if system.pieces is not None:
        values |= {"edges": system.pieces.edges, "legendre": system.pieces.coefficients}
    return values
