"""The answer in the forms that other programs take."""
