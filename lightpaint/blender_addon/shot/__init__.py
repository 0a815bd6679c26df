# SPDX-License-Identifier: GPL-3.0-or-later
"""A view layer as a shot: its passes, its render and its files."""
