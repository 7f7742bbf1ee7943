"""Draws the figures of Issanchou et al. (2018), one file per section: figure 9 is `section_4_1.figure_9`."""
