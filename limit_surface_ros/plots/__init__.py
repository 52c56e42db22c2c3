# SPDX-License-Identifier: Apache-2.0
"""Pictures; matplotlib is an optional extra and imported where it is used."""
