"""The room of lightings: `Basis` and `Target` become a `Solution`."""
