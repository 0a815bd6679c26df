"""The analysis of an answer: its errors, better answers, and the reasons why it is not closer."""
