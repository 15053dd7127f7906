"""Concealed effects."""
