"""Which runs of a table to make: a goal in words, a search inside the table's capacity, proposals with reasons.

`find.find_runs` is the way in.
"""
