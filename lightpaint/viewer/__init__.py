"""Pictures of light drawn in a browser: what the painter's page, reports and galleries share."""
