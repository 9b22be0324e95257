"""Families of integration methods as data with order conditions that are checked when a method is made."""
