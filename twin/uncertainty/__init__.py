"""A plan under uncertainty: thousands of futures drawn from what is not known exactly, and what they come to."""
