"""Wishes for illuminance and power, as requirements of a solve."""
