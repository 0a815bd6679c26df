# SPDX-License-Identifier: GPL-3.0-or-later
"""The painter: a program, and a connection to it. Nothing here knows Blender."""
