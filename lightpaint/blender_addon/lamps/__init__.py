# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of a scene, their groups and their levels."""
