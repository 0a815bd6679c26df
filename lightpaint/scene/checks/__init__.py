"""What is looked at in a scene's files before Mitsuba reads them, which trusts them."""
