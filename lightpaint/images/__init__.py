"""Picture files in and out, and images in memory: with their noise, denoised, in blocks."""
