"""Limit surfaces: contact patches, the model family, its maps, and measures of error."""
