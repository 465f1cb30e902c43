"""Faults that emulated tables and hosts can be given, by name: what real hardware, cabling and operators do to a run.

`FAULTS` in `catalogue` lists them; a `Fault` is one of them at a time of the table's clock. None of this is ever part
of a run on a real table: `twin run --device` refuses it.
"""
