"""Images in texels: where these lie on each kind of light, and what they show."""
