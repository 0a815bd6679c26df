"""Reading and writing pictures, and images in memory: noise, denoising, blocks."""
