"""Gauges: positive functions, homogeneous of degree one, that tell how far out a load or motion is."""
