"""Support functions and support points of surfaces: the inverse of their normal maps."""
