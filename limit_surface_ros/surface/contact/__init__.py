"""Contacts: shapes, pressures and patches."""
