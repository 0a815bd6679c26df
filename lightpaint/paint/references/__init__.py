"""References: pictures whose light somebody asks for, as layers that fit the scene."""
