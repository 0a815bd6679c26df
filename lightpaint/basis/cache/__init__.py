"""The cache: bases, denoised planes and facts about scenes from earlier runs."""
