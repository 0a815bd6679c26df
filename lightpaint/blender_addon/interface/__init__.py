# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels, operators, and what goes on behind them."""
