"""Draws the figures of Issanchou et al. (2018), a file for each section: figure 9 is `section_4_1.figure_9`."""
