"""Make a table perform what is asked: play, compare, correct the command through the measured transfer function, again.

The iteration of every shake-table laboratory, there called transfer function iteration or off-line iteration (S. Dyke,
T. Ranf, B. Nepote, L. Giacosa, "Transfer Function Iteration Algorithm", Purdue University 2011,
datacenterhub.org/resources/1295, for Quanser's UCIST shake table), in control iterative learning by inversion
(D. A. Bristow, M. Tharayil, A. G. Alleyne, IEEE Control Systems Magazine 26(3), 96-114, 2006). Nothing here knows the
plant: a table is a function from a command to what was measured.
"""
