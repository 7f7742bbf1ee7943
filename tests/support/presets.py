"""Strings of a preset file, for tests that write one."""

STRING_A = """\
[[string]]
name = "A"
open_note = "A1"
linear_density = "23.88 g/m"
tension = "215.5 N"
diameter = "0.085 in"
"""
STRING_G = """\
[[string]]
name = "G"
open_note = "G2"
linear_density = "6.69 g/m"
diameter = "1.14 mm"
"""
