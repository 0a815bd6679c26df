"""The work of a batch: steps of looks and parts of bases, and the processes that do them."""
