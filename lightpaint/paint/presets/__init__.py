"""Presets: requests for a whole scene, made as layers that fit any scene."""
