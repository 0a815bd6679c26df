"""Luminaires: measured light distributions, their files, and emitters of Mitsuba that have them."""
