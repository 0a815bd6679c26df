"""The cache of earlier runs: bases, denoised planes, facts about scenes."""
