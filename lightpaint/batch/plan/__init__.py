"""The plan of a batch: the steps of each look, their cost, and which of them are done."""
