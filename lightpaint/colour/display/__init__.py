"""From linear light to what a display is sent: exposure, view transforms, sRGB."""
