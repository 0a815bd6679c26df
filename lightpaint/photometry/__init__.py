"""Photometry of a scene: illuminance in lux on measuring planes, from every light."""
