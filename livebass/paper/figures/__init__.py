"""The figures of Issanchou et al. (2018), in one file for each section: `section_4_1.figure_9`."""
