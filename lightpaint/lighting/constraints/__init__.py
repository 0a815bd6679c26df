"""What is asked of lights, and the unknowns that this leaves."""
