"""Which surfaces are convex by the way they are built."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.surface.power_sum import PowerSum

if TYPE_CHECKING:
    from limit_surface_ros.surface.protocol import LimitSurface


def is_convex_by_construction(surface: LimitSurface) -> bool:
    """Tell whether a surface is convex whatever its coefficients are.

    Support points and dissipations are; a power sum is if every exponent is at least 1/2, for
    then each term is a convex function; of a polynomial nothing is known without its coefficients.
    """
    if isinstance(surface, PowerSum):
        return bool(surface.exponents.min() >= 0.5)
    return surface.kind in ("dissipation", "point_contacts")
