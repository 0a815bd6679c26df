"""Pictures of light drawn in a browser, for the painter's page, reports and galleries."""
