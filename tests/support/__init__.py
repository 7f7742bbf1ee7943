"""Set-ups and tools that tests of several rooms share."""
