"""Which lighting comes closest? `Basis` and `Target` become a `Solution`."""
