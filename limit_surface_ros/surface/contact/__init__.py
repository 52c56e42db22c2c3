# SPDX-License-Identifier: Apache-2.0
"""Contacts: shapes, pressures and patches."""
